// Keys to commands. Letters work on the map only, so that fields and lists keep theirs.

import type { Actions, Command } from "./commands";
import type { Stage } from "./stage";

const NAMES: Record<string, string> = {
  mod: "Ctrl",
  shift: "Shift",
  alt: "Alt",
  arrowleft: "←",
  arrowright: "→",
  arrowup: "↑",
  arrowdown: "↓",
  escape: "Esc",
  delete: "Del",
  backspace: "⌫",
  enter: "Enter",
  home: "Home",
};

/** A key as people write it. */
export const shownKey = (key: string): string[] =>
  key === "shift++" || key === "shift+?"
    ? []
    : key.split(/\+(?=.)/).map((part) => NAMES[part] ?? part.toUpperCase());

function keyOf(event: KeyboardEvent): string {
  const parts = [
    event.ctrlKey || event.metaKey ? "mod+" : "",
    event.altKey ? "alt+" : "",
    event.shiftKey ? "shift+" : "",
  ];
  return parts.join("") + event.key.toLowerCase();
}

const isField = (target: EventTarget | null): boolean =>
  target instanceof HTMLElement &&
  target.closest("input:not([type=radio], [type=checkbox]), dialog, [role=listbox]") !== null;

const isControl = (target: EventTarget | null): boolean =>
  target instanceof HTMLElement && target.closest("button, a, summary, [role=option]") !== null;

export function listen(
  stageElement: HTMLElement,
  stage: Stage,
  actions: Actions,
  commands: readonly Command[],
  singleKeys: () => boolean,
): void {
  const byKey = new Map(commands.flatMap((command) => command.keys.map((key) => [key, command])));
  document.addEventListener("keydown", (event) => {
    const command = byKey.get(keyOf(event));
    const inField = isField(event.target);
    if (inField && !command?.everywhere) return;
    const own = ["enter", " "].includes(event.key.toLowerCase()) || event.key.startsWith("Arrow");
    if (own && document.activeElement !== stageElement) {
      // Buttons have their Enter and Space; elsewhere the arrows scroll.
      if (isControl(event.target) || event.target !== document.body) return;
    }
    if (event.key === " " && document.activeElement === stageElement) {
      stage.panning = true;
      event.preventDefault();
      return;
    }
    if (!command || (event.key.length === 1 && keyOf(event).length === 1 && !singleKeys())) return;
    event.preventDefault();
    command.run(event);
  });
  document.addEventListener("keyup", (event) => {
    if (event.key === " ") stage.panning = false;
  });
  window.addEventListener("blur", () => (stage.panning = false));
  const onMap = (event: ClipboardEvent): boolean =>
    !isField(event.target) && (document.getSelection()?.isCollapsed ?? true);
  document.addEventListener("copy", (event) => onMap(event) && actions.copy(event, false));
  document.addEventListener("cut", (event) => onMap(event) && actions.copy(event, true));
  document.addEventListener("paste", (event) => onMap(event) && actions.paste(event));
}

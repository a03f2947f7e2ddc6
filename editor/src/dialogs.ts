// Questions and lists in front of the page. The browser's own dialogs keep the focus inside.

import { h } from "./dom";
import type { Command } from "./commands";
import { shownKey } from "./keyboard";
import { labelOf, type Suggestion } from "./types";

function open(dialog: HTMLDialogElement): void {
  document.body.append(dialog);
  dialog.addEventListener("close", () => dialog.remove());
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  dialog.showModal();
}

const closing = (label: string, act?: () => void, kind = ""): HTMLButtonElement => {
  const button = h("button", { type: "button", class: kind }, label);
  button.addEventListener("click", () => {
    button.closest("dialog")?.close();
    act?.();
  });
  return button;
};

/** Tells something, or asks before something is done. */
export function ask(title: string, text: string, act?: [string, () => void]): void {
  const buttons = act ? [closing("Cancel"), closing(act[0], act[1], "primary")] : [closing("Close", undefined, "primary")];
  open(h("dialog", { "aria-labelledby": "dialog-title" },
    h("h2", { id: "dialog-title" }, title), h("p", {}, text), h("div", { class: "row end" }, ...buttons)));
}

/** Edges with the behaviours that their geometry suggests, to choose from. */
export function review(
  found: readonly Suggestion[],
  look: (edge: string) => void,
  apply: (chosen: readonly Suggestion[]) => void,
): void {
  const boxes = found.map((one, number) => {
    const box = h("input", { type: "checkbox", id: `suggestion-${number}` });
    box.checked = true;
    return { one, box };
  });
  const rows = boxes.map(({ one, box }) =>
    h("li", {}, box,
      h("label", { for: box.id }, h("b", {}, one.edge),
        h("span", {}, `${labelOf(one.behavior)} → `, h("strong", {}, labelOf(one.suggested)))),
      closing("Show", () => look(one.edge), "link")));
  const many = `${found.length} edge${found.length > 1 ? "s bend" : " bends"} otherwise than its behaviour says`;
  open(h("dialog", { "aria-labelledby": "dialog-title", class: "wide" },
    h("h2", { id: "dialog-title" }, "Suggested behaviours"),
    h("p", {}, `${many.replace("bend otherwise than its behaviour says", "bend otherwise than their behaviours say")}. Untick what shall stay.`),
    h("ul", { class: "suggestions" }, ...rows),
    h("div", { class: "row end" }, closing("Cancel"),
      closing("Apply", () => apply(boxes.filter(({ box }) => box.checked).map(({ one }) => one)), "primary"))));
}

/** All keys, by group. */
export function help(commands: readonly Command[], singleKeys: boolean, setSingleKeys: (on: boolean) => void): void {
  const groups = new Map<string, Command[]>();
  for (const command of commands) {
    groups.set(command.group, [...(groups.get(command.group) ?? []), command]);
  }
  const pointer: [string, string][] = [
    ["Drag nodes", "Move them (Alt: without snapping)"],
    ["Drag over the floor", "Select what is inside (Shift: add)"],
    ["Shift + click", "Add to the selection or take away"],
    ["Wheel", "Zoom"],
    ["Space + drag, right drag", "Pan"],
    ["Double click", "Add a node"],
    ["Ctrl + C, X, V", "Copy, cut, paste at the pointer"],
  ];
  const keys = (command: Command): HTMLElement[] => {
    const shown = command.keys.filter((key) => !key.startsWith("shift+arrow") && key !== "shift+enter");
    return shown.slice(0, 4).flatMap((key) => {
      const parts = shownKey(key);
      return parts.length ? [h("span", { class: "keys" }, ...parts.map((part) => h("kbd", {}, part)))] : [];
    });
  };
  const box = h("input", { type: "checkbox", id: "single-keys" });
  box.checked = singleKeys;
  box.addEventListener("change", () => setSingleKeys(box.checked));
  open(h("dialog", { "aria-labelledby": "dialog-title", class: "help" },
    h("header", { class: "row" }, h("h2", { id: "dialog-title" }, "Keys"), closing("Close", undefined, "primary")),
    h("div", { class: "groups" },
      ...[...groups].map(([group, members]) =>
        h("section", {}, h("h3", {}, group), h("dl", {}, ...members.flatMap((command) => [
          h("dt", {}, ...keys(command)), h("dd", {}, command.label)])))),
      h("section", {}, h("h3", {}, "Pointer"),
        h("dl", {}, ...pointer.flatMap(([what, does]) => [h("dt", {}, what), h("dd", {}, does)])))),
    h("p", { class: "note" }, box, h("label", { for: "single-keys" }, " Keys without Ctrl or Alt are shortcuts"))));
}

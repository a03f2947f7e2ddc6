// Puts the page together.

import { api, type Refused } from "./api";
import { Checks } from "./checks";
import { Actions, commandsFor, type Panels } from "./commands";
import { ask, help, review } from "./dialogs";
import { byId, h } from "./dom";
import { Drafting } from "./drafting";
import { Editor, type Tool } from "./editor";
import { setBehavior } from "./edits";
import type { Patch } from "./graph";
import { Inspector } from "./inspector";
import { listen } from "./keyboard";
import { PlanPanel } from "./plan_panel";
import { Search } from "./search";
import { Stage } from "./stage";
import { StatusBar } from "./status_bar";
import { Sync } from "./sync";
import { Theme } from "./theme";
import type { Opened, Suggestion } from "./types";

const SINGLE_KEYS = "toponav-single-keys";

function start(opened: Opened): void {
  const stageElement = byId("stage");
  const editor = new Editor(stageElement, byId("announcer"), opened);
  const sync = new Sync(editor, opened.version);
  const drafting = new Drafting(editor);
  const stage = new Stage(stageElement, editor, drafting, sync);
  const actions = new Actions(editor, drafting, stage);
  const checks = new Checks(editor);
  const search = new Search(editor, stageElement);
  new Inspector(byId("inspector"), editor, actions);
  new PlanPanel(editor, drafting);
  new StatusBar(editor);
  new Theme(editor, opened.floor);

  let singleKeys = localStorage.getItem(SINGLE_KEYS) !== "off";
  const panels: Panels = {
    help: () =>
      help(commands, singleKeys, (on) => {
        singleKeys = on;
        localStorage.setItem(SINGLE_KEYS, on ? "on" : "off");
      }),
    search: () => search.focus(),
    save: () => void sync.save(),
    build: () => build(editor),
    suggest: () => void suggest(editor, drafting),
    nextFault: (by) => checks.next(by),
  };
  const commands = commandsFor(editor, actions, panels);
  listen(stageElement, stage, actions, commands, () => singleKeys);

  const clicks: Record<string, () => void> = {
    undo: () => editor.undo(),
    redo: () => editor.redo(),
    snap: () => actions.toggleSnapping(),
    build: panels.build,
    "empty-build": panels.build,
    suggest: panels.suggest,
    help: panels.help,
    "zoom-in": () => actions.zoom(1.25),
    "zoom-out": () => actions.zoom(0.8),
    "show-all": () => editor.fitAll(),
  };
  for (const [id, act] of Object.entries(clicks)) byId(id).addEventListener("click", act);
  for (const button of document.querySelectorAll<HTMLElement>("button[data-tool]")) {
    button.addEventListener("click", () => actions.setTool(button.dataset["tool"] as Tool));
  }
  for (const id of ["build", "empty-build"]) byId(id).hidden = !opened.can_construct;
  nameRooms(editor);
  editor.on(["graph"], () => nameRooms(editor));
  document.title = `${opened.file} – toponav`;
  byId("file-name").textContent = opened.file;
  editor.view.width = stageElement.clientWidth;
  editor.view.height = stageElement.clientHeight;
  editor.fitAll();
  stageElement.focus({ preventScroll: true });
  document.body.dataset["ready"] = "true";
}

/** Offers the building's rooms and the map's where a room is asked for. */
function nameRooms(editor: Editor): void {
  if (editor.dragging) return;
  const names = new Set(editor.rooms.all.map((room) => room.name));
  for (const node of editor.graph.nodes.values()) if (node.room) names.add(node.room);
  const list = byId("room-names");
  if (list.childElementCount === names.size) return;
  list.replaceChildren(...[...names].sort().map((name) => h("option", { value: name })));
}

function build(editor: Editor): void {
  if (!editor.canConstruct) {
    ask("Build automatically", "This needs the building: start the editor with --scene, --area or --plan.");
    return;
  }
  const run = async (): Promise<void> => {
    editor.say("Building the map");
    document.body.dataset["busy"] = "true";
    try {
      const made = await api.construct(editor.graph.toDocument());
      const done: Patch = editor.patchTo(made, "build automatically");
      editor.do(done);
      editor.fitAll();
      editor.say(`Built ${made.nodes.length} nodes, ${made.edges.length} edges`);
    } catch (error) {
      const { message, remedy } = error as Refused;
      ask("The map cannot be built", `${message}. ${remedy}.`);
    }
    delete document.body.dataset["busy"];
  };
  const count = editor.graph.nodes.size;
  if (!count) void run();
  else {
    ask("Build automatically?", `The ${count} nodes drawn so far are replaced. Undo brings them back.`, [
      "Replace",
      () => void run(),
    ]);
  }
}

async function suggest(editor: Editor, drafting: Drafting): Promise<void> {
  const chosen = editor.edges.size ? [...editor.edges] : undefined;
  try {
    const found = await api.suggestions(editor.graph.toDocument(), chosen);
    if (!found.length) {
      ask("Suggested behaviours", "Every behaviour fits the geometry.");
      return;
    }
    review(
      found,
      (edge) => editor.goTo([], [edge]),
      (wanted) => apply(editor, drafting, wanted),
    );
  } catch (error) {
    const { message, remedy } = error as Refused;
    ask("No suggestions", `${message}. ${remedy}`);
  }
}

function apply(editor: Editor, drafting: Drafting, wanted: readonly Suggestion[]): void {
  const edges = wanted.flatMap(({ edge, suggested }) =>
    setBehavior(editor.graph, [edge], suggested).edges,
  );
  editor.do({ label: "suggested behaviours", nodes: [], edges });
  drafting.settle(wanted.map(({ edge }) => edge));
  editor.select([], wanted.map(({ edge }) => edge));
}

api.open().then(start, (error: Refused) => {
  const reason = `${error.message}. ${error.remedy}`;
  document.body.replaceChildren(h("main", { class: "sorry" }, h("h1", {}, "The map cannot be opened"), h("p", {}, reason)));
  document.body.dataset["ready"] = "failed";
});

// The line at the foot of the page, and what the buttons at its sides show.

import { byId, eachFrame } from "./dom";
import type { Editor, Tool } from "./editor";

const HINTS: Record<Tool, string> = {
  select: "Click or drag to select; drag nodes to move them; double-click adds a node",
  node: "Click to add a node; R D H O choose its kind",
  edge: "Click a node, then the next; Shift connects both ways; Esc ends",
  corridor: "Click along the corridor: each click adds a node to both lanes; Esc ends",
  plan: "Click the room to start in, then the room to go to",
};
const BARS_M = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100];

export class StatusBar {
  private shownScale = 0;

  constructor(private readonly editor: Editor) {
    const cursor = eachFrame(() => this.cursor());
    const view = eachFrame(() => this.scaleBar());
    editor.on(["cursor"], cursor);
    editor.on(["view"], view);
    editor.on(["graph", "tool", "snap"], eachFrame(() => this.buttons()));
    editor.on(["selection"], eachFrame(() => this.sayLater()));
    this.cursor();
    this.scaleBar();
    this.buttons();
  }

  private cursor(): void {
    const { editor } = this;
    const { x, y } = editor.cursor;
    byId("position").textContent = `x ${x.toFixed(2)} m   y ${y.toFixed(2)} m`;
    byId("room").textContent = editor.rooms.at(editor.cursor)?.name ?? "";
  }

  private scaleBar(): void {
    const { scale } = this.editor.view;
    if (scale === this.shownScale) return;
    this.shownScale = scale;
    const metres = BARS_M.find((bar) => bar * scale >= 60) ?? BARS_M.at(-1)!;
    byId("scale-bar").style.width = `${(metres * scale).toFixed(0)}px`;
    byId("scale-text").textContent = `${metres} m`;
  }

  private buttons(): void {
    const { editor } = this;
    if (editor.dragging) return;
    const { undoLabel, redoLabel } = editor.history;
    const undo = byId<HTMLButtonElement>("undo");
    const redo = byId<HTMLButtonElement>("redo");
    undo.disabled = undoLabel === null;
    redo.disabled = redoLabel === null;
    undo.title = `Undo ${undoLabel ?? ""} (Ctrl+Z)`;
    redo.title = `Redo ${redoLabel ?? ""} (Ctrl+Shift+Z)`;
    for (const button of document.querySelectorAll<HTMLElement>("button[data-tool]")) {
      button.setAttribute("aria-pressed", String(button.dataset["tool"] === editor.tool));
    }
    byId("snap").setAttribute("aria-pressed", String(editor.snapping));
    byId("stage").dataset["tool"] = editor.tool;
    byId("hint").textContent = HINTS[editor.tool];
    byId("counts").textContent = `${editor.graph.nodes.size} nodes, ${editor.graph.edges.size} edges`;
    byId("empty").hidden = editor.graph.nodes.size > 0 || editor.tool !== "select";
  }

  /** Describes the one element that is selected to whoever listens. */
  private sayLater(): void {
    const { editor } = this;
    if (editor.dragging || editor.nodes.size + editor.edges.size !== 1) return;
    for (const id of editor.nodes) {
      const node = editor.graph.nodes.get(id);
      if (!node) continue;
      const kind = node.kind.replace("_", " ");
      const [out, into] = [editor.graph.outEdges(id).length, editor.graph.inEdges(id).length];
      editor.say(`${id}, ${kind}, at ${node.x.toFixed(2)}, ${node.y.toFixed(2)}; ${out} edges out, ${into} in`);
    }
    for (const id of editor.edges) {
      const edge = editor.graph.edges.get(id);
      if (!edge) continue;
      const behavior = edge.behavior.replace("_", " ");
      editor.say(`${behavior} from ${edge.source} to ${edge.target}, ${edge.length.toFixed(1)} m`);
    }
  }
}

// Everything that a key can do, in one table: the help page shows it, the keyboard runs it.

import type { Drafting } from "./drafting";
import type { Editor, Tool } from "./editor";
import { moveNodes, reverse, setBehavior, setKind } from "./edits";
import { nextNode, pick, pickNode } from "./picking";
import { copyOf, paste, type Piece, pieceOfText, pieceToText } from "./pieces";
import type { Stage } from "./stage";
import { BEHAVIORS, type Behavior, KINDS, type Kind, type Point } from "./types";

export interface Command {
  readonly group: string;
  readonly label: string;
  /** Keys as `event.key` gives them, lower case, with `mod+`, `shift+`, `alt+` before. */
  readonly keys: readonly string[];
  readonly run: (event: KeyboardEvent) => void;
  /** Also when a text field has the focus. */
  readonly everywhere?: boolean;
}

const ARROWS: Record<string, Point> = {
  arrowleft: { x: -1, y: 0 },
  arrowright: { x: 1, y: 0 },
  arrowup: { x: 0, y: 1 },
  arrowdown: { x: 0, y: -1 },
};

export class Actions {
  private piece: Piece | null = null;
  private pasted = 0;

  constructor(
    private readonly editor: Editor,
    private readonly drafting: Drafting,
    private readonly stage: Stage,
  ) {}

  setTool(tool: Tool): void {
    this.editor.setTool(tool);
    const said = { select: "Select", node: "Add nodes", edge: "Connect", corridor: "Corridor", plan: "Try a plan" };
    this.editor.say(`${said[tool]} tool`);
  }

  setKind(kind: Kind): void {
    const { editor } = this;
    if (editor.nodes.size) editor.do(setKind(editor.graph, editor.nodes, kind));
    editor.kind = kind;
    editor.emit("tool");
    editor.say(`${kind.replace("_", " ")}`);
  }

  setBehavior(behavior: Behavior | "auto"): void {
    const { editor } = this;
    if (editor.edges.size && behavior !== "auto") {
      this.drafting.settle(editor.edges);
      editor.do(setBehavior(editor.graph, editor.edges, behavior));
    } else editor.behavior = behavior;
    editor.emit("tool");
    editor.say(behavior.replace("_", " "));
  }

  reverse(): void {
    const { editor } = this;
    const patch = reverse(editor.graph, editor.edges);
    if (editor.do(patch)) editor.select([], patch.edges.flatMap(({ after }) => after?.id ?? []));
  }

  toggleSnapping(): void {
    const { editor } = this;
    editor.snapping = !editor.snapping;
    editor.say(`Snapping ${editor.snapping ? "on" : "off"}`);
    editor.emit("snap");
  }

  zoom(factor: number): void {
    const { view } = this.editor;
    view.zoomAt({ x: view.width / 2, y: view.height / 2 }, factor);
    this.editor.viewChanged();
  }

  copy(event: ClipboardEvent, cut: boolean): void {
    const { editor } = this;
    if (editor.nodes.size === 0) return;
    this.piece = copyOf(editor.graph, editor.nodes);
    this.pasted = 0;
    event.clipboardData?.setData("text/plain", pieceToText(this.piece));
    event.preventDefault();
    editor.say(`${cut ? "Cut" : "Copied"} ${this.piece.nodes.length} nodes`);
    if (cut) editor.deleteSelection();
  }

  paste(event: ClipboardEvent): void {
    const piece = pieceOfText(event.clipboardData?.getData("text/plain") ?? "");
    if (!piece) return;
    event.preventDefault();
    this.putDown(piece, this.editor.cursor);
  }

  duplicate(): void {
    const { editor } = this;
    if (editor.nodes.size) this.putDown(copyOf(editor.graph, editor.nodes), null);
  }

  /** Arrow keys: nudge what is selected, else move the cross. */
  arrow(event: KeyboardEvent): void {
    const { editor } = this;
    const direction = ARROWS[event.key.toLowerCase()]!;
    if (event.altKey) {
      this.jump(direction);
      return;
    }
    if (editor.tool === "select" && editor.nodes.size && !event.ctrlKey && !event.metaKey) {
      const step = event.shiftKey ? 0.5 : 0.05;
      const by = { x: direction.x * step, y: direction.y * step };
      const key = `nudge ${[...editor.nodes].join(" ")}`;
      editor.do(moveNodes(editor.graph, editor.nodes, by), key);
      return;
    }
    const step = (event.shiftKey ? 100 : 10) / editor.view.scale;
    this.moveCross({
      x: editor.cursor.x + direction.x * step,
      y: editor.cursor.y + direction.y * step,
    });
  }

  /** Enter: what a click at the cross would do. */
  press(event: KeyboardEvent): void {
    const { editor } = this;
    const pixel = editor.view.toPixels(editor.cursor);
    if (editor.tool !== "select") {
      this.stage.click(editor.cursor, pickNode(editor.graph, editor.view, pixel), event.shiftKey);
      this.moveCross(editor.cursor);
      return;
    }
    const hit = pick(editor.graph, editor.view, pixel);
    if (!hit) editor.say("Nothing is here");
    else if (event.shiftKey) editor.toggle(hit.kind, hit.id);
    else {
      editor.select(hit.kind === "node" ? [hit.id] : [], hit.kind === "edge" ? [hit.id] : []);
    }
  }

  /** Goes through the nodes in order of their names. */
  step(by: 1 | -1): void {
    const { editor } = this;
    const ids = [...editor.graph.nodes.keys()].sort();
    if (!ids.length) return;
    const at = ids.indexOf([...editor.nodes].at(-1) ?? "");
    const next = ids[at < 0 ? 0 : (at + by + ids.length) % ids.length]!;
    editor.goTo([next], []);
    this.moveCross(editor.cursor);
  }

  /** Goes through the edges at the node in hand, or at the ends of the edge in hand. */
  stepEdge(by: 1 | -1): void {
    const { editor } = this;
    const edge = editor.graph.edges.get([...editor.edges].at(-1) ?? "");
    const node = [...editor.nodes].at(-1) ?? edge?.source;
    if (node === undefined) return;
    const edges = editor.graph.edgesAt(node);
    const at = edges.findIndex((one) => one.id === edge?.id);
    const next = edges[at < 0 ? 0 : (at + by + edges.length) % edges.length];
    if (next) editor.goTo([], [next.id]);
  }

  escape(): void {
    const { editor } = this;
    if (this.stage.cancel()) return;
    if (editor.source !== null || this.drafting.corridor) {
      this.drafting.corridor = null;
      editor.goal = null;
      editor.setPlans([]);
      editor.setSource(null);
    } else if (editor.tool !== "select") this.setTool("select");
    else editor.select([]);
  }

  selectAll(): void {
    const { editor } = this;
    editor.select(editor.graph.nodes.keys(), editor.graph.edges.keys());
    editor.say(`Selected ${editor.nodes.size} nodes`);
  }

  private jump(direction: Point): void {
    const { editor } = this;
    const next = nextNode(editor.graph, editor.cursor, direction);
    if (!next) {
      editor.say("No node lies that way");
      return;
    }
    if (editor.tool === "select") editor.select([next.id]);
    else editor.say(next.id);
    this.moveCross(next);
  }

  private moveCross(place: Point): void {
    const { editor } = this;
    const { x, y } = place;
    editor.setCursor({ x, y });
    if (!editor.view.shows(editor.cursor)) {
      Object.assign(editor.view, editor.cursor);
      editor.viewChanged();
    }
    this.stage.preview(editor.cursor);
    this.stage.overlay.showCross(editor.cursor);
  }

  private putDown(piece: Piece, at: Point | null): void {
    const { editor } = this;
    const shift = at ? this.pasted * 0.3 : 0;
    this.pasted += 1;
    const place = at && { x: at.x + shift, y: at.y - shift };
    const { patch, ids } = paste(editor.graph, piece, place);
    editor.do(patch);
    editor.select(ids);
    editor.say(`Pasted ${ids.length} nodes`);
  }
}

export interface Panels {
  help(): void;
  search(): void;
  save(): void;
  build(): void;
  suggest(): void;
  nextFault(by: 1 | -1): void;
}

export function commandsFor(editor: Editor, actions: Actions, panels: Panels): Command[] {
  const tool = (key: string, label: string, name: Tool): Command => ({
    group: "Tools",
    label,
    keys: [key],
    run: () => actions.setTool(name),
  });
  const arrows = Object.keys(ARROWS).flatMap((key) => [key, `shift+${key}`]);
  return [
    tool("v", "Select and move", "select"),
    tool("n", "Add nodes", "node"),
    tool("e", "Connect nodes (Shift: both ways)", "edge"),
    tool("c", "Draw a corridor with two lanes", "corridor"),
    tool("p", "Try a plan between two rooms", "plan"),
    { group: "Tools", label: "Build automatically", keys: ["b"], run: () => panels.build() },
    { group: "Tools", label: "Suggest behaviours", keys: ["s"], run: () => panels.suggest() },
    { group: "Tools", label: "Snapping on or off", keys: ["g"], run: () => actions.toggleSnapping() },
    ...KINDS.map(({ value, label, key }) => ({
      group: "Kind of node",
      label,
      keys: [key],
      run: () => {
        // With the node tool in hand it is the next node's kind, not the last one's.
        if (editor.tool === "node") editor.select([]);
        actions.setKind(value);
      },
    })),
    ...BEHAVIORS.map(({ value, label, key }) => ({
      group: "Behaviour of edge",
      label,
      keys: [key],
      run: () => actions.setBehavior(value),
    })),
    {
      group: "Behaviour of edge",
      label: "From geometry (new edges)",
      keys: ["0"],
      run: () => actions.setBehavior("auto"),
    },
    { group: "Edit", label: "Undo", keys: ["mod+z"], run: () => editor.undo() },
    { group: "Edit", label: "Redo", keys: ["mod+shift+z", "mod+y"], run: () => editor.redo() },
    { group: "Edit", label: "Duplicate", keys: ["mod+d"], run: () => actions.duplicate() },
    { group: "Edit", label: "Delete", keys: ["delete", "backspace"], run: () => editor.deleteSelection() },
    { group: "Edit", label: "Turn edges round", keys: ["x"], run: () => actions.reverse() },
    { group: "Edit", label: "Select all", keys: ["mod+a"], run: () => actions.selectAll() },
    { group: "Edit", label: "Nudge 5 cm (Shift: 50 cm), or move the cross", keys: arrows, run: (event) => actions.arrow(event) },
    { group: "Edit", label: "Click at the cross", keys: ["enter", "shift+enter"], run: (event) => actions.press(event) },
    { group: "Edit", label: "Cancel, back to Select, select nothing", keys: ["escape"], run: () => actions.escape() },
    { group: "Edit", label: "Save now", keys: ["mod+s"], run: () => panels.save(), everywhere: true },
    { group: "Find", label: "Search by name", keys: ["/", "mod+f"], run: () => panels.search() },
    { group: "Find", label: "Next node that way", keys: Object.keys(ARROWS).map((key) => `alt+${key}`), run: (event) => actions.arrow(event) },
    { group: "Find", label: "Next node by name", keys: ["."], run: () => actions.step(1) },
    { group: "Find", label: "Node before by name", keys: [","], run: () => actions.step(-1) },
    { group: "Find", label: "Next edge of this node", keys: ["]"], run: () => actions.stepEdge(1) },
    { group: "Find", label: "Edge before of this node", keys: ["["], run: () => actions.stepEdge(-1) },
    { group: "Find", label: "Next fault", keys: ["f"], run: () => panels.nextFault(1) },
    { group: "Find", label: "Fault before", keys: ["shift+f"], run: () => panels.nextFault(-1) },
    { group: "View", label: "Zoom in", keys: ["+", "=", "shift++"], run: () => actions.zoom(1.25) },
    { group: "View", label: "Zoom out", keys: ["-"], run: () => actions.zoom(0.8) },
    { group: "View", label: "Show all", keys: ["home"], run: () => editor.fitAll() },
    { group: "View", label: "All keys", keys: ["?", "shift+?"], run: () => panels.help() },
  ];
}

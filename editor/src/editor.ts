// The editor's state: the map, what is selected, the tool in hand. Panels listen to it.

import { Drawing } from "./drawing";
import { eachFrame } from "./dom";
import { remove } from "./edits";
import { type Box, boxOf } from "./geometry";
import { Graph, type Patch } from "./graph";
import { History } from "./history";
import { Rooms } from "./rooms";
import type { Behavior, Fault, Kind, MapDocument, MapNode, Opened, Plan, Point } from "./types";
import { Viewport } from "./viewport";

export type Tool = "select" | "node" | "edge" | "corridor" | "plan";
export type Topic = "marker" | "graph" | "selection" | "tool" | "view" | "faults" | "cursor" | "plan" | "snap";

export class Editor {
  readonly view = new Viewport();
  readonly drawing: Drawing;
  graph: Graph;
  history: History;
  rooms: Rooms;
  file: string;
  canConstruct: boolean;

  readonly nodes = new Set<string>();
  readonly edges = new Set<string>();
  tool: Tool = "select";
  kind: Kind = "hallway";
  behavior: Behavior | "auto" = "auto";
  snapping = true;
  faults: readonly Fault[] = [];
  /** Where the pointer or the keyboard's cross is, in metres. */
  cursor: Point = { x: 0, y: 0 };
  /** Node that an edge or a plan is being drawn from. */
  source: string | null = null;
  goal: string | null = null;
  plans: readonly Plan[] = [];
  shownPlan = 0;

  /** Whether nodes are being dragged: panels wait until that ends. */
  dragging = false;
  /** Counts edits, so that answers to old questions can be told. */
  revision = 0;

  private readonly listeners = new Map<Topic, (() => void)[]>();
  private readonly redrawSoon = eachFrame(() => this.drawing.follow());
  private readonly announcer: HTMLElement;

  constructor(stage: HTMLElement, announcer: HTMLElement, opened: Opened) {
    this.graph = Graph.of(opened.map);
    this.history = new History(this.graph);
    this.rooms = new Rooms(opened.floor);
    this.file = opened.file;
    this.canConstruct = opened.can_construct;
    this.announcer = announcer;
    this.drawing = new Drawing(stage, this.view, this.graph);
    this.drawing.setGraph(this.graph);
  }

  on(topics: readonly Topic[], listener: () => void): void {
    for (const topic of topics) {
      this.listeners.set(topic, [...(this.listeners.get(topic) ?? []), listener]);
    }
  }

  emit(topic: Topic): void {
    for (const listener of this.listeners.get(topic) ?? []) listener();
  }

  /** Says something to people who listen to the page. */
  say(text: string): void {
    this.announcer.textContent = this.announcer.textContent === text ? `${text}\u00a0` : text;
  }

  /** Does an edit that can be undone. */
  do(patch: Patch, mergeKey = ""): boolean {
    if (!this.history.do(patch, mergeKey)) return false;
    this.changed(patch);
    return true;
  }

  /** Adds to the last edit, so that one undo takes back both. */
  amend(last: Patch, patch: Patch): Patch | null {
    const whole = this.history.amend(last, patch);
    if (whole) this.changed(patch);
    return whole;
  }

  undo(): void {
    const label = this.history.undoLabel;
    const patch = this.history.undo();
    this.say(patch ? `Undone: ${label}` : "Nothing to undo");
    if (patch) this.stepped(patch);
  }

  redo(): void {
    const label = this.history.redoLabel;
    const patch = this.history.redo();
    this.say(patch ? `Redone: ${label}` : "Nothing to redo");
    if (patch) this.stepped(patch);
  }

  /** Shows another map, as after a reload; what was done before cannot be undone any more. */
  replaceMap(document: MapDocument): void {
    this.graph = Graph.of(document);
    this.history = new History(this.graph);
    this.source = null;
    this.drawing.setGraph(this.graph);
    this.changed({ label: "", nodes: [], edges: [] });
  }

  /** One undoable edit that makes this map of any other. */
  patchTo(document: MapDocument, label: string): Patch {
    const gone = <Element extends { id: string }>(
      present: ReadonlyMap<string, Element>,
      wanted: readonly Element[],
    ): [string, Element | null][] => [
      ...[...present.keys()].map((id): [string, null] => [id, null]),
      ...wanted.map((element): [string, Element] => [element.id, element]),
    ];
    return this.graph.patch(
      label,
      gone(this.graph.nodes, document.nodes),
      gone(this.graph.edges, document.edges),
    );
  }

  select(nodes: Iterable<string>, edges: Iterable<string> = [], add = false): void {
    if (!add) {
      this.nodes.clear();
      this.edges.clear();
    }
    for (const id of nodes) if (this.graph.nodes.has(id)) this.nodes.add(id);
    for (const id of edges) if (this.graph.edges.has(id)) this.edges.add(id);
    this.markSelection();
    this.emit("selection");
  }

  toggle(kind: "node" | "edge", id: string): void {
    const ids = kind === "node" ? this.nodes : this.edges;
    if (!ids.delete(id)) ids.add(id);
    this.markSelection();
    this.emit("selection");
  }

  get hasSelection(): boolean {
    return this.nodes.size + this.edges.size > 0;
  }

  deleteSelection(): void {
    const count = this.nodes.size + this.edges.size;
    if (this.do(remove(this.graph, this.nodes, this.edges))) this.say(`Deleted ${count}`);
  }

  setTool(tool: Tool): void {
    this.tool = tool;
    this.source = this.goal = null;
    if (tool !== "plan") this.setPlans([]);
    this.drawing.mark("source", [], []);
    this.emit("tool");
  }

  setSource(id: string | null): void {
    this.source = id;
    this.drawing.mark("source", id ? [id] : [], []);
    this.emit("tool");
  }

  setPlans(plans: readonly Plan[], shown = 0): void {
    this.plans = plans;
    this.shownPlan = shown;
    this.drawing.setTrail(plans[shown]?.edges ?? []);
    this.emit("plan");
  }

  setFaults(faults: readonly Fault[]): void {
    this.faults = faults;
    for (const severity of ["warning", "error"] as const) {
      const of = faults.filter((fault) => fault.severity === severity).map((one) => one.element);
      const named = (what: string): string[] =>
        of.filter((name) => name.startsWith(what)).map((name) => name.slice(what.length));
      this.drawing.mark(severity, named("node "), named("edge "));
    }
    this.emit("faults");
  }

  setCursor(place: Point): void {
    this.cursor = place;
    this.emit("cursor");
  }

  /** Tells that the view moved; the stage follows in the next frame. */
  viewChanged(): void {
    this.redrawSoon();
    this.emit("view");
  }

  fitAll(): void {
    const points: Point[] = [...this.graph.nodes.values()];
    const floor = this.rooms.covered;
    if (floor) points.push({ x: floor.left, y: floor.bottom }, { x: floor.right, y: floor.top });
    const box = boxOf(points);
    if (box) this.view.fit(box, 36);
    this.viewChanged();
  }

  /** Brings elements into sight and selects them. */
  goTo(nodes: readonly string[], edges: readonly string[], place?: Point | null): void {
    this.select(nodes, edges);
    const box = this.boxOfSelection() ?? (place ? boxOf([place]) : null);
    if (!box) return;
    const middle = { x: (box.left + box.right) / 2, y: (box.bottom + box.top) / 2 };
    const { view } = this;
    const isFar = view.scale < 25 || (box.right - box.left) * view.scale > view.width * 0.8;
    if (isFar) view.fit(box, 160, 45);
    else if (!view.shows(middle, 120)) Object.assign(view, middle);
    this.setCursor(middle);
    this.viewChanged();
    this.emit("marker");
  }

  boxOfSelection(): Box | null {
    const points: MapNode[] = [...this.nodes].flatMap((id) => this.graph.nodes.get(id) ?? []);
    for (const id of this.edges) {
      const edge = this.graph.edges.get(id);
      for (const end of edge ? [edge.source, edge.target] : []) {
        points.push(...[this.graph.nodes.get(end) ?? []].flat());
      }
    }
    return boxOf(points);
  }

  private stepped(patch: Patch): void {
    this.changed(patch);
    const alive = <Element>(changes: readonly { id: string; after: Element | null }[]): string[] =>
      changes.filter(({ after }) => after !== null).map(({ id }) => id);
    this.select(alive(patch.nodes), patch.nodes.length ? [] : alive(patch.edges));
  }

  private changed(patch: Patch): void {
    this.revision += 1;
    this.drawing.apply(patch);
    for (const id of [...this.nodes]) if (!this.graph.nodes.has(id)) this.nodes.delete(id);
    for (const id of [...this.edges]) if (!this.graph.edges.has(id)) this.edges.delete(id);
    if (this.source && !this.graph.nodes.has(this.source)) this.setSource(null);
    this.markSelection();
    this.emit("graph");
    this.emit("selection");
  }

  private markSelection(): void {
    this.drawing.mark("selected", this.nodes, this.edges);
  }
}


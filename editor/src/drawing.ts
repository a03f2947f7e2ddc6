// The map on the stage: its elements, drawn on a layer of which the stage shows a part.

import { settled, svg } from "./dom";
import { type Box, boxOf } from "./geometry";
import type { Graph, Patch } from "./graph";
import { Layer } from "./layer";
import { namedToTheLeft } from "./names";
import { arrow, edgeLine, nodeOutline, nodeRadius } from "./shapes";
import type { FloorDocument, MapEdge, MapNode, Point } from "./types";
import type { Viewport } from "./viewport";

const SHARPEN_AFTER_MS = 110;
const ALL_NAMES_SCALE = 55;
const ROOM_NAMES_SCALE = 9;

export class Drawing {
  private readonly layer: Layer;
  private readonly canvas = svg("svg", { "aria-hidden": "true" });
  private readonly world = svg("g");
  private readonly floorGroup = svg("g");
  private readonly groups = {
    trail: svg("g", { class: "trail" }),
    edges: svg("g", { class: "edges" }),
    nodes: svg("g", { class: "nodes" }),
    names: svg("g", { class: "names" }),
  };
  private readonly edgePaths = new Map<string, SVGPathElement>();
  private readonly nodePaths = new Map<string, SVGPathElement>();
  private readonly nodeNames = new Map<string, SVGTextElement>();
  private readonly marks = new Map<string, Map<string, Set<string>>>();
  private readonly image = svg("image", { class: "floor", preserveAspectRatio: "none" });
  private leftNames: ReadonlySet<string> = new Set();
  private extent: FloorDocument["extent"] | null = null;
  private trail: readonly string[] = [];
  /** Elements that lie off the layer: they would cost as much as the others. */
  private readonly hidden = new WeakSet<SVGElement>();
  private readonly redrawSoon = settled(() => this.redraw(), SHARPEN_AFTER_MS);
  /** Where there is something to draw, once asked for. */
  private content: Box | null = null;

  constructor(
    private readonly stage: HTMLElement,
    private readonly view: Viewport,
    private graph: Graph,
  ) {
    this.floorGroup.append(this.image);
    this.world.append(this.floorGroup, ...Object.values(this.groups));
    this.canvas.append(this.world);
    this.layer = new Layer(view);
    this.layer.element.append(this.canvas);
    stage.prepend(this.layer.element);
  }

  setGraph(graph: Graph): void {
    this.graph = graph;
    for (const paths of [this.edgePaths, this.nodePaths, this.nodeNames]) {
      for (const element of paths.values()) element.remove();
      paths.clear();
    }
    this.content = null;
    for (const edge of graph.edges.values()) this.addEdge(edge);
    for (const node of graph.nodes.values()) this.addNode(node);
    this.redraw();
  }

  setFloor(extent: FloorDocument["extent"], url: string): void {
    this.extent = extent;
    this.content = null;
    this.image.setAttribute("href", url);
    this.placeFloor();
  }

  /** Follows the viewport: moves and stretches the layer, and draws anew where that is not enough. */
  follow(): void {
    const { layer, view } = this;
    const wanted = layer.wanted((this.content ??= this.boxOfContent()));
    if (wanted !== null) this.draw(wanted);
    else layer.move();
    // While the wheel turns the picture is stretched; it is drawn sharp once that ends.
    if (view.scale !== layer.scale) this.redrawSoon.later();
  }

  redraw(): void {
    this.draw(this.view.scale);
  }

  /** Draws what the stage shows, and some more, with so many pixels for a metre. */
  private draw(scale: number): void {
    const { layer, view } = this;
    const rescaled = scale !== layer.scale;
    layer.begin(scale);
    const tx = layer.width / 2 - view.x * scale;
    const ty = layer.height / 2 + view.y * scale;
    this.world.setAttribute("transform", `translate(${tx.toFixed(1)} ${ty.toFixed(1)})`);
    if (rescaled) {
      const stroke = Math.min(2.4, Math.max(1, scale * 0.045));
      layer.element.style.setProperty("--stroke", `${stroke.toFixed(2)}px`);
      this.stage.classList.toggle("all-names", view.scale >= ALL_NAMES_SCALE);
      this.stage.classList.toggle("no-names", view.scale < ROOM_NAMES_SCALE);
      this.placeFloor();
      this.placeTrail();
    }
    this.placeShown(rescaled);
  }

  /** Places what the layer shows; what did not change is placed only if it was hidden. */
  private placeShown(rescaled: boolean): void {
    const { left, right, bottom, top } = this.layer.shown;
    const { nodes } = this.graph;
    if (rescaled) this.leftNames = namedToTheLeft([...nodes.values()], this.layer.scale);
    for (const node of nodes.values()) {
      const path = this.nodePaths.get(node.id);
      if (!path) continue;
      const isOut = node.x < left || node.x > right || node.y < bottom || node.y > top;
      if (isOut) this.hide(path, this.nodeNames.get(node.id));
      else if (rescaled || this.hidden.has(path)) this.placeNode(node);
    }
    for (const edge of this.graph.edges.values()) {
      const path = this.edgePaths.get(edge.id);
      const [a, b] = [nodes.get(edge.source), nodes.get(edge.target)];
      if (!path || !a || !b) continue;
      const isOut =
        Math.max(a.x, b.x) < left ||
        Math.min(a.x, b.x) > right ||
        Math.max(a.y, b.y) < bottom ||
        Math.min(a.y, b.y) > top;
      if (isOut) this.hide(path);
      else if (rescaled || this.hidden.has(path)) this.placeEdge(edge);
    }
  }

  private hide(...elements: (SVGElement | undefined)[]): void {
    for (const element of elements) {
      if (!element || this.hidden.has(element)) continue;
      this.hidden.add(element);
      element.style.display = "none";
    }
  }

  private show(...elements: SVGElement[]): void {
    for (const element of elements) if (this.hidden.delete(element)) element.style.display = "";
  }

  private boxOfContent(): Box | null {
    const points: Point[] = [...this.graph.nodes.values()];
    if (this.extent) {
      const [left, right, bottom, top] = this.extent;
      points.push({ x: left, y: bottom }, { x: right, y: top });
    }
    return boxOf(points);
  }

  /** Draws what a patch changed, and the edges at moved nodes. */
  apply(patch: Patch): void {
    this.content = null;
    const edges = new Set<string>();
    for (const { id, before, after } of patch.edges) {
      if (after === null) {
        this.edgePaths.get(id)?.remove();
        this.edgePaths.delete(id);
      } else if (before === null || !this.edgePaths.has(id)) this.addEdge(after);
      edges.add(id);
      for (const edge of [before, after]) {
        const twin = edge && this.graph.between(edge.target, edge.source);
        if (twin) edges.add(twin.id);
      }
    }
    for (const { id, after } of patch.nodes) {
      if (after === null) {
        this.nodePaths.get(id)?.remove();
        this.nodeNames.get(id)?.remove();
        this.nodePaths.delete(id);
        this.nodeNames.delete(id);
        continue;
      }
      if (!this.nodePaths.has(id)) this.addNode(after);
      this.placeNode(after);
      for (const edge of this.graph.edgesAt(id)) edges.add(edge.id);
    }
    for (const id of edges) {
      const edge = this.graph.edges.get(id);
      if (edge) this.placeEdge(edge);
    }
    if (this.trail.length) this.placeTrail();
  }

  /** Marks elements with a class, and those that had it before no more. */
  mark(name: string, nodes: Iterable<string>, edges: Iterable<string>): void {
    const wanted = new Map([
      ["n", new Set(nodes)],
      ["e", new Set(edges)],
    ]);
    const before = this.marks.get(name);
    for (const [kind, paths] of [
      ["n", this.nodePaths],
      ["e", this.edgePaths],
    ] as const) {
      const now = wanted.get(kind)!;
      for (const id of before?.get(kind) ?? []) {
        if (!now.has(id)) {
          paths.get(id)?.classList.remove(name);
          if (kind === "n") this.nodeNames.get(id)?.classList.remove(name);
        }
      }
      for (const id of now) {
        paths.get(id)?.classList.add(name);
        if (kind === "n") this.nodeNames.get(id)?.classList.add(name);
      }
    }
    this.marks.set(name, wanted);
  }

  /** Draws a plan's edges broad, underneath. */
  setTrail(edges: readonly string[]): void {
    this.trail = edges;
    this.placeTrail();
  }

  private addEdge(edge: MapEdge): void {
    const path = svg("path", { "data-edge": edge.id });
    this.edgePaths.set(edge.id, path);
    this.groups.edges.append(path);
    this.placeEdge(edge);
  }

  private addNode(node: MapNode): void {
    const path = svg("path", { "data-node": node.id });
    const name = svg("text");
    this.nodePaths.set(node.id, path);
    this.nodeNames.set(node.id, name);
    this.groups.nodes.append(path);
    this.groups.names.append(name);
    this.placeNode(node);
  }

  private at(place: Point): Point {
    return { x: place.x * this.layer.scale, y: -place.y * this.layer.scale };
  }

  private placeNode(node: MapNode): void {
    const path = this.nodePaths.get(node.id);
    const name = this.nodeNames.get(node.id);
    if (!path || !name) return;
    this.show(path, name);
    const { x, y } = this.at(node);
    const radius = nodeRadius(node.kind, this.layer.scale);
    const outline = nodeOutline(node.kind, radius);
    if (path.getAttribute("d") !== outline) path.setAttribute("d", outline);
    path.setAttribute("transform", `translate(${x.toFixed(1)} ${y.toFixed(1)})`);
    setKeeping(path, `node ${node.kind}`, KEPT);
    if (name.textContent !== node.id) name.textContent = node.id;
    setKeeping(name, node.kind, KEPT);
    const side = this.leftNames.has(node.id) ? -1 : 1;
    name.setAttribute("text-anchor", side < 0 ? "end" : "start");
    name.setAttribute("x", (x + side * (radius + 4)).toFixed(1));
    name.setAttribute("y", (y + 3.5).toFixed(1));
  }

  private placeEdge(edge: MapEdge): void {
    const path = this.edgePaths.get(edge.id);
    const line = path && this.lineOf(edge);
    if (!line) return;
    this.show(path);
    setKeeping(path, `edge ${edge.behavior}`, KEPT);
    path.setAttribute("d", arrow(line, Math.min(11, Math.max(4, this.layer.scale * 0.17))));
  }

  private lineOf(edge: MapEdge) {
    const source = this.graph.nodes.get(edge.source);
    const target = this.graph.nodes.get(edge.target);
    if (!source || !target) return undefined;
    const rim = (node: MapNode): number => nodeRadius(node.kind, this.layer.scale) + 1;
    const hasTwin = this.graph.between(edge.target, edge.source) !== undefined;
    return edgeLine(this.at(source), this.at(target), rim(source), rim(target), hasTwin);
  }

  private placeTrail(): void {
    const lines = this.trail.flatMap((id) => {
      const edge = this.graph.edges.get(id);
      return (edge && this.lineOf(edge)) ?? [];
    });
    const d = lines.map(({ from, to }) => `M${from.x} ${from.y}L${to.x} ${to.y}`).join("");
    this.groups.trail.replaceChildren(...(d ? [svg("path", { d })] : []));
  }

  private placeFloor(): void {
    if (!this.extent) return;
    const [left, right, bottom, top] = this.extent;
    const scale = this.layer.scale;
    this.image.setAttribute("x", String(left * scale));
    this.image.setAttribute("y", String(-top * scale));
    this.image.setAttribute("width", String((right - left) * scale));
    this.image.setAttribute("height", String((top - bottom) * scale));
    this.image.classList.toggle("pixels", scale > 60);
  }
}

const KEPT = ["selected", "error", "warning", "hover", "on-plan", "source"];

/** Sets an element's classes but keeps marks that others put there. */
function setKeeping(element: SVGElement, classes: string, kept: readonly string[]): void {
  const marks = kept.filter((name) => element.classList.contains(name));
  const wanted = [classes, ...marks].join(" ");
  if (element.getAttribute("class") !== wanted) element.setAttribute("class", wanted);
}

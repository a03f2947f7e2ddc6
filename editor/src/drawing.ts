// The map on the stage. The layer is larger than the stage, so that panning only moves it.

import { h, settled, svg } from "./dom";
import type { Graph, Patch } from "./graph";
import { arrow, edgeLine, nodeOutline, nodeRadius } from "./shapes";
import type { FloorDocument, MapEdge, MapNode, Point } from "./types";
import type { Viewport } from "./viewport";

const OVERSCAN_PX = 256;
const LEAST_ZOOM = 0.72;
const MOST_ZOOM = 1.6;
const SHARPEN_AFTER_MS = 110;
const ALL_NAMES_SCALE = 55;
const ROOM_NAMES_SCALE = 9;

export class Drawing {
  /** Moved as a whole: a transform of the SVG itself would lay out all of it in each frame. */
  private readonly layer = h("div", { class: "layer" });
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
  private extent: FloorDocument["extent"] | null = null;
  private trail: readonly string[] = [];
  private drawnScale = 0;
  private readonly redrawSoon = settled(() => this.redraw(), SHARPEN_AFTER_MS);
  /** Place that the layer's middle showed when it was drawn. */
  private anchor: Point = { x: 0, y: 0 };

  constructor(
    private readonly stage: HTMLElement,
    private readonly view: Viewport,
    private graph: Graph,
  ) {
    this.floorGroup.append(this.image);
    this.world.append(this.floorGroup, ...Object.values(this.groups));
    this.canvas.append(this.world);
    this.layer.append(this.canvas);
    stage.prepend(this.layer);
  }

  setGraph(graph: Graph): void {
    this.graph = graph;
    for (const paths of [this.edgePaths, this.nodePaths, this.nodeNames]) {
      for (const element of paths.values()) element.remove();
      paths.clear();
    }
    for (const edge of graph.edges.values()) this.addEdge(edge);
    for (const node of graph.nodes.values()) this.addNode(node);
    this.redraw();
  }

  setFloor(extent: FloorDocument["extent"], url: string): void {
    this.extent = extent;
    this.image.setAttribute("href", url);
    this.placeFloor();
  }

  /** Follows the viewport: moves the layer, and draws anew where that is not enough. */
  follow(): void {
    const { view } = this;
    const dx = (this.anchor.x - view.x) * view.scale;
    const dy = (view.y - this.anchor.y) * view.scale;
    const zoom = view.scale / this.drawnScale;
    const isFar = Math.abs(dx) > OVERSCAN_PX || Math.abs(dy) > OVERSCAN_PX;
    if (isFar || zoom < LEAST_ZOOM || zoom > MOST_ZOOM) {
      this.redraw();
      return;
    }
    // While the wheel turns the picture is stretched; it is drawn sharp once that ends.
    if (zoom !== 1) this.redrawSoon.later();
    const scale = zoom === 1 ? "" : ` scale(${zoom.toFixed(4)})`;
    this.layer.style.transform = `translate(${dx.toFixed(1)}px, ${dy.toFixed(1)}px)${scale}`;
  }

  redraw(): void {
    const { view } = this;
    const rescaled = view.scale !== this.drawnScale;
    this.anchor = { x: view.x, y: view.y };
    this.drawnScale = view.scale;
    const width = view.width + 2 * OVERSCAN_PX;
    const height = view.height + 2 * OVERSCAN_PX;
    const { style } = this.layer;
    style.left = style.top = `${-OVERSCAN_PX}px`;
    style.width = `${width}px`;
    style.height = `${height}px`;
    style.transform = "translate(0px, 0px)";
    const tx = width / 2 - view.x * view.scale;
    const ty = height / 2 + view.y * view.scale;
    this.world.setAttribute("transform", `translate(${tx.toFixed(1)} ${ty.toFixed(1)})`);
    if (!rescaled) return;
    const stroke = Math.min(2.4, Math.max(1, view.scale * 0.045));
    this.layer.style.setProperty("--stroke", `${stroke.toFixed(2)}px`);
    this.stage.classList.toggle("all-names", view.scale >= ALL_NAMES_SCALE);
    this.stage.classList.toggle("no-names", view.scale < ROOM_NAMES_SCALE);
    this.placeFloor();
    for (const edge of this.graph.edges.values()) this.placeEdge(edge);
    for (const node of this.graph.nodes.values()) this.placeNode(node);
    this.placeTrail();
  }

  /** Draws what a patch changed, and the edges at moved nodes. */
  apply(patch: Patch): void {
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
    return { x: place.x * this.drawnScale, y: -place.y * this.drawnScale };
  }

  private placeNode(node: MapNode): void {
    const path = this.nodePaths.get(node.id);
    const name = this.nodeNames.get(node.id);
    if (!path || !name) return;
    const { x, y } = this.at(node);
    const radius = nodeRadius(node.kind, this.drawnScale);
    const outline = nodeOutline(node.kind, radius);
    if (path.getAttribute("d") !== outline) path.setAttribute("d", outline);
    path.setAttribute("transform", `translate(${x.toFixed(1)} ${y.toFixed(1)})`);
    setKeeping(path, `node ${node.kind}`, KEPT);
    if (name.textContent !== node.id) name.textContent = node.id;
    setKeeping(name, node.kind, KEPT);
    name.setAttribute("x", (x + radius + 4).toFixed(1));
    name.setAttribute("y", (y + 3.5).toFixed(1));
  }

  private placeEdge(edge: MapEdge): void {
    const path = this.edgePaths.get(edge.id);
    const line = path && this.lineOf(edge);
    if (!line) return;
    setKeeping(path, `edge ${edge.behavior}`, KEPT);
    path.setAttribute("d", arrow(line, Math.min(11, Math.max(4, this.drawnScale * 0.17))));
  }

  private lineOf(edge: MapEdge) {
    const source = this.graph.nodes.get(edge.source);
    const target = this.graph.nodes.get(edge.target);
    if (!source || !target) return undefined;
    const rim = (node: MapNode): number => nodeRadius(node.kind, this.drawnScale) + 1;
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
    const scale = this.drawnScale;
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

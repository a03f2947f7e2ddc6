// The pointer on the stage: panning, selecting, dragging, and the tools' clicks.

import type { Drafting } from "./drafting";
import type { Editor } from "./editor";
import { replaceNodes } from "./edits";
import { distance, tidy } from "./geometry";
import type { Patch } from "./graph";
import { Overlay } from "./overlay";
import { pick, pickNode, within } from "./picking";
import { snap } from "./snap";
import type { Sync } from "./sync";
import type { MapNode, Point } from "./types";

const DRAG_PX = 4;

type Gesture =
  | { kind: "pan"; last: Point; moved: boolean }
  | { kind: "band"; from: Point; add: boolean }
  | { kind: "press"; from: Point; node: string | null; collapse: (() => void) | null }
  | { kind: "drag"; from: Point; lead: MapNode; origins: MapNode[]; done: Patch | null }
  | { kind: "draw"; from: Point };

export class Stage {
  readonly overlay: Overlay;
  private gesture: Gesture | null = null;
  private spaceHeld = false;
  /** The stage's upper left corner on the page; asking for it would lay out the page. */
  private corner: Point = { x: 0, y: 0 };

  constructor(
    private readonly element: HTMLElement,
    private readonly editor: Editor,
    private readonly drafting: Drafting,
    private readonly sync: Sync,
  ) {
    this.overlay = new Overlay(element, editor.view);
    element.addEventListener("pointerdown", (event) => this.down(event));
    element.addEventListener("pointermove", (event) => this.move(event));
    element.addEventListener("pointerup", (event) => this.up(event));
    element.addEventListener("pointercancel", () => this.cancel());
    element.addEventListener("pointerleave", () => this.hover(null));
    element.addEventListener("dblclick", (event) => this.doubleClick(event));
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    element.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    new ResizeObserver(() => this.resized()).observe(element);
    editor.on(["marker"], () => this.overlay.showCross(editor.hasSelection ? null : editor.cursor));
    editor.on(["view"], () => this.overlay.showCross(null));
    editor.on(["tool", "view"], () => this.preview(editor.cursor));
  }

  set panning(held: boolean) {
    this.spaceHeld = held;
    this.element.classList.toggle("can-pan", held);
  }

  /** Ends the gesture in hand; what was dragged goes back. True if there was one. */
  cancel(): boolean {
    const { gesture } = this;
    this.finish();
    if (gesture?.kind === "drag" && gesture.done) this.editor.undo();
    return gesture !== null;
  }

  /** A click of the tool in hand, by pointer or by the Enter key. */
  click(place: Point, hit: MapNode | null, shift: boolean): void {
    const { editor, drafting } = this;
    const at = hit ?? (editor.snapping ? snap(place, editor.graph, editor.view).place : place);
    if (editor.tool === "node") {
      if (hit) editor.select([hit.id]);
      else drafting.addNode(at);
    } else if (editor.tool === "edge") drafting.connectAt(at, hit, shift);
    else if (editor.tool === "corridor") drafting.extend({ x: at.x, y: at.y });
    else if (editor.tool === "plan") void drafting.planAt(place, hit);
  }

  /** Shows where the next click of a drawing tool leads. */
  preview(place: Point): void {
    const { editor, overlay } = this;
    if (this.gesture?.kind === "drag" || this.gesture?.kind === "band") return;
    const snapped =
      editor.snapping && ["node", "edge", "corridor"].includes(editor.tool)
        ? snap(place, editor.graph, editor.view)
        : null;
    const source = editor.source ? editor.graph.nodes.get(editor.source) : undefined;
    const from = editor.tool === "corridor" ? this.drafting.corridor?.at : source;
    overlay.clear();
    if (snapped) overlay.showGuides(snapped);
    if (from && editor.tool !== "select" && editor.goal === null) {
      overlay.showLine(from, snapped?.place ?? place);
    }
  }

  private pixel(event: MouseEvent): Point {
    return { x: event.clientX - this.corner.x, y: event.clientY - this.corner.y };
  }

  private down(event: PointerEvent): void {
    if ((event.target as Element).closest("#empty")) return;
    const pixel = this.pixel(event);
    this.element.focus({ preventScroll: true });
    this.element.setPointerCapture(event.pointerId);
    this.overlay.showCross(null);
    if (event.button !== 0 || this.spaceHeld) {
      this.gesture = { kind: "pan", last: pixel, moved: false };
      this.element.classList.add("panning");
      return;
    }
    const { editor } = this;
    const node = pickNode(editor.graph, editor.view, pixel);
    if (editor.tool === "select" || (editor.tool === "node" && node)) this.press(event, pixel);
    else {
      this.gesture = { kind: "draw", from: pixel };
      if (editor.tool === "edge" && node && editor.source === null) editor.setSource(node.id);
      else this.click(editor.view.toMetres(pixel), node, event.shiftKey);
    }
  }

  private press(event: PointerEvent, pixel: Point): void {
    const { editor } = this;
    const hit = pick(editor.graph, editor.view, pixel);
    if (!hit) {
      this.gesture = { kind: "band", from: pixel, add: event.shiftKey };
      return;
    }
    const chosen = hit.kind === "node" ? editor.nodes : editor.edges;
    const only = (): void =>
      editor.select(hit.kind === "node" ? [hit.id] : [], hit.kind === "edge" ? [hit.id] : []);
    let collapse: (() => void) | null = null;
    if (event.shiftKey || event.ctrlKey || event.metaKey) editor.toggle(hit.kind, hit.id);
    else if (!chosen.has(hit.id)) only();
    else collapse = only;
    const node = hit.kind === "node" ? hit.id : null;
    this.gesture = { kind: "press", from: pixel, node, collapse };
  }

  private move(event: PointerEvent): void {
    const pixel = this.pixel(event);
    const { editor, gesture } = this;
    const place = editor.view.toMetres(pixel);
    if (gesture?.kind === "pan") {
      editor.view.panBy(pixel.x - gesture.last.x, pixel.y - gesture.last.y);
      gesture.last = pixel;
      gesture.moved = true;
      editor.viewChanged();
      return;
    }
    editor.setCursor(place);
    if (gesture?.kind === "band") {
      this.overlay.showBand(gesture.from, pixel);
    } else if (gesture?.kind === "press") {
      if (distance(pixel, gesture.from) > DRAG_PX) this.startDrag(gesture.node, gesture.from);
    } else if (gesture?.kind === "drag") this.drag(gesture, pixel, event.altKey);
    else {
      this.preview(place);
      this.hover(pixel);
    }
  }

  private startDrag(node: string | null, from: Point): void {
    const { editor } = this;
    const lead = node ? editor.graph.nodes.get(node) : undefined;
    if (!lead) return;
    if (!editor.nodes.has(lead.id)) editor.select([lead.id]);
    const origins = [...editor.nodes].flatMap((id) => editor.graph.nodes.get(id) ?? []);
    this.sync.hold = editor.dragging = true;
    this.gesture = { kind: "drag", from, lead, origins, done: null };
  }

  private drag(gesture: Gesture & { kind: "drag" }, pixel: Point, free: boolean): void {
    const { editor } = this;
    const dx = (pixel.x - gesture.from.x) / editor.view.scale;
    const dy = (gesture.from.y - pixel.y) / editor.view.scale;
    const wished = { x: gesture.lead.x + dx, y: gesture.lead.y + dy };
    const snapped =
      editor.snapping && !free ? snap(wished, editor.graph, editor.view, editor.nodes) : null;
    const to = snapped?.place ?? wished;
    const by = { x: to.x - gesture.lead.x, y: to.y - gesture.lead.y };
    const nodes = gesture.origins.map((node) => ({
      ...node,
      x: tidy(node.x + by.x),
      y: tidy(node.y + by.y),
    }));
    const label = nodes.length === 1 ? "move node" : `move ${nodes.length} nodes`;
    const patch = replaceNodes(editor.graph, label, nodes);
    if (gesture.done) gesture.done = editor.amend(gesture.done, patch) ?? gesture.done;
    else if (editor.do(patch)) gesture.done = patch;
    this.overlay.showGuides(snapped);
  }

  private up(event: PointerEvent): void {
    const pixel = this.pixel(event);
    const { editor, gesture } = this;
    this.finish();
    if (gesture?.kind === "band") {
      if (distance(pixel, gesture.from) <= DRAG_PX) {
        if (!gesture.add) editor.select([]);
        return;
      }
      const [a, b] = [editor.view.toMetres(gesture.from), editor.view.toMetres(pixel)];
      const found = within(editor.graph, {
        left: Math.min(a.x, b.x),
        right: Math.max(a.x, b.x),
        bottom: Math.min(a.y, b.y),
        top: Math.max(a.y, b.y),
      });
      editor.select(found.nodes, found.edges, gesture.add);
      editor.say(`Selected ${found.nodes.length} nodes, ${found.edges.length} edges`);
    } else if (gesture?.kind === "press") gesture.collapse?.();
    else if (gesture?.kind === "draw" && editor.tool === "edge" && editor.source) {
      // A press on one node and a release on another is an edge, as two clicks are.
      if (distance(pixel, gesture.from) <= DRAG_PX) return;
      const node = pickNode(editor.graph, editor.view, pixel);
      this.click(editor.view.toMetres(pixel), node, event.shiftKey);
      editor.setSource(null);
    } else if (gesture?.kind === "pan" && !gesture.moved && event.button === 2) {
      editor.setSource(null);
      this.drafting.corridor = null;
      this.overlay.clear();
    }
  }

  private finish(): void {
    this.gesture = null;
    this.overlay.clear();
    this.element.classList.remove("panning");
    if (this.sync.hold) {
      this.sync.hold = this.editor.dragging = false;
      this.editor.emit("graph");
      this.editor.emit("selection");
      void this.sync.save();
    }
  }

  private doubleClick(event: MouseEvent): void {
    const { editor } = this;
    const pixel = this.pixel(event);
    if (editor.tool !== "select" || pick(editor.graph, editor.view, pixel)) return;
    const place = editor.view.toMetres(pixel);
    this.drafting.addNode(editor.snapping ? snap(place, editor.graph, editor.view).place : place);
  }

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    const pixels = event.deltaMode === 1 ? event.deltaY * 16 : event.deltaY;
    this.editor.view.zoomAt(this.pixel(event), Math.exp(-pixels * (event.ctrlKey ? 0.01 : 0.0016)));
    this.editor.viewChanged();
  }

  private hover(pixel: Point | null): void {
    const { editor } = this;
    const hit = pixel && pick(editor.graph, editor.view, pixel);
    const isNode = hit?.kind === "node";
    editor.drawing.mark("hover", isNode ? [hit.id] : [], hit?.kind === "edge" ? [hit.id] : []);
    this.element.classList.toggle("over-node", isNode);
  }

  private resized(): void {
    const { view } = this.editor;
    const { left, top } = this.element.getBoundingClientRect();
    this.corner = { x: left, y: top };
    view.width = this.element.clientWidth;
    view.height = this.element.clientHeight;
    this.editor.drawing.redraw();
    this.editor.viewChanged();
  }
}

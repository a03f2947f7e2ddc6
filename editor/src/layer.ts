// The picture of the map: larger than the stage, so that panning and zooming only move and stretch
// it, until what it does not show comes into sight.

import { h } from "./dom";
import type { Box } from "./geometry";
import type { Point } from "./types";
import type { Viewport } from "./viewport";

const OVERSCAN_PX = 256;
/** Around a place on the map, for its name and arrows. */
const MARGIN_PX = 160;
/** Stretched further than this the picture is too blurred, even for the time of a gesture. */
const MOST_ZOOM = 2;
/** Drawn while zooming out: a picture of more than is seen, so that the next one waits longer. */
const AHEAD = 0.72;

export class Layer {
  /** Moved as a whole: a transform of the SVG itself would lay out all of it in each frame. */
  readonly element = h("div", { class: "layer" });
  /** Pixels per metre of the picture; 0 before there is one. */
  scale = 0;
  /** Place that the layer's middle showed when it was drawn. */
  private anchor: Point = { x: 0, y: 0 };
  /** The stage's size when it was drawn. */
  private drawnFor = { width: 0, height: 0 };

  constructor(private readonly view: Viewport) {}

  get width(): number {
    return this.view.width + 2 * OVERSCAN_PX;
  }

  get height(): number {
    return this.view.height + 2 * OVERSCAN_PX;
  }

  /** What the picture shows, in metres; what lies a margin beyond it may reach into it. */
  get shown(): Box {
    const [wide, high] = [this.width / 2 + MARGIN_PX, this.height / 2 + MARGIN_PX];
    return around(this.anchor, wide / this.scale, high / this.scale);
  }

  /** The scale that a new picture needs, or null where this one does. */
  wanted(content: Box | null): number | null {
    const { view, scale, drawnFor } = this;
    if (view.width !== drawnFor.width || view.height !== drawnFor.height) return view.scale;
    if (!this.covers(content)) return view.scale < scale ? view.scale * AHEAD : view.scale;
    return view.scale > scale * MOST_ZOOM ? view.scale : null;
  }

  /** Begins a new picture around the middle of the stage. */
  begin(scale: number): void {
    const { x, y, width, height } = this.view;
    this.anchor = { x, y };
    this.drawnFor = { width, height };
    this.scale = scale;
    const { style } = this.element;
    style.left = style.top = `${-OVERSCAN_PX}px`;
    style.width = `${this.width}px`;
    style.height = `${this.height}px`;
    this.move();
  }

  /** Moves and stretches the picture to where the stage shows it. */
  move(): void {
    const { view, anchor } = this;
    const dx = (anchor.x - view.x) * view.scale;
    const dy = (view.y - anchor.y) * view.scale;
    const zoom = view.scale / this.scale;
    const stretch = zoom === 1 ? "" : ` scale(${zoom.toFixed(4)})`;
    this.element.style.transform = `translate(${dx.toFixed(1)}px, ${dy.toFixed(1)}px)${stretch}`;
  }

  /** Whether all of the content that the stage shows is on the picture. */
  private covers(content: Box | null): boolean {
    const { view, scale } = this;
    if (!content) return true;
    const drawn = around(this.anchor, this.width / 2 / scale, this.height / 2 / scale);
    const seen = around(view, view.width / 2 / view.scale, view.height / 2 / view.scale);
    const margin = MARGIN_PX / scale;
    return (
      Math.max(seen.left, content.left - margin) >= drawn.left &&
      Math.min(seen.right, content.right + margin) <= drawn.right &&
      Math.max(seen.bottom, content.bottom - margin) >= drawn.bottom &&
      Math.min(seen.top, content.top + margin) <= drawn.top
    );
  }
}

const around = ({ x, y }: Point, wide: number, high: number): Box => ({
  left: x - wide,
  right: x + wide,
  bottom: y - high,
  top: y + high,
});

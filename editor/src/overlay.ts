// Marks above the map that belong to the gesture in hand: band, rubber line, guides, cross.

import { svg } from "./dom";
import type { Snapped } from "./snap";
import type { Point } from "./types";
import type { Viewport } from "./viewport";

export class Overlay {
  private readonly root = svg("svg", { class: "overlay", "aria-hidden": "true" });
  private readonly band = svg("rect", { class: "band" });
  private readonly line = svg("path", { class: "rubber" });
  private readonly guides = svg("path", { class: "guides" });
  private readonly cross = svg("path", { class: "cross" });

  constructor(
    stage: HTMLElement,
    private readonly view: Viewport,
  ) {
    this.root.append(this.guides, this.line, this.band, this.cross);
    stage.append(this.root);
    this.clear();
    this.showCross(null);
  }

  clear(): void {
    for (const path of [this.line, this.guides]) set(path, "d", "");
    set(this.band, "visibility", "hidden");
  }

  showBand(from: Point, to: Point): void {
    set(this.band, "visibility", "visible");
    set(this.band, "x", String(Math.min(from.x, to.x)));
    set(this.band, "y", String(Math.min(from.y, to.y)));
    set(this.band, "width", String(Math.abs(from.x - to.x)));
    set(this.band, "height", String(Math.abs(from.y - to.y)));
  }

  showLine(from: Point, to: Point): void {
    const [a, b] = [this.view.toPixels(from), this.view.toPixels(to)];
    set(this.line, "d", `M${a.x} ${a.y}L${b.x} ${b.y}`);
  }

  showGuides(snapped: Snapped | null): void {
    const d = (snapped?.guides ?? []).map(({ axis, with: other }) => {
      const at = this.view.toPixels(other);
      const place = this.view.toPixels(snapped!.place);
      return axis === "x"
        ? `M${at.x} ${Math.min(at.y, place.y) - 12}V${Math.max(at.y, place.y) + 12}`
        : `M${Math.min(at.x, place.x) - 12} ${at.y}H${Math.max(at.x, place.x) + 12}`;
    });
    set(this.guides, "d", d.join(""));
  }

  showCross(place: Point | null): void {
    const at = place && this.view.toPixels(place);
    set(
      this.cross,
      "d",
      at ? `M${at.x - 11} ${at.y}H${at.x - 3}M${at.x + 3} ${at.y}H${at.x + 11}` +
        `M${at.x} ${at.y - 11}V${at.y - 3}M${at.x} ${at.y + 3}V${at.y + 11}` : "",
    );
  }
}

/** Sets an attribute only if that changes it: the browser paints again even if it does not. */
function set(element: SVGElement, name: string, value: string): void {
  if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

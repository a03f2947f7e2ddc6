// Which part of the map the stage shows: metres to pixels and back.

import type { Box } from "./geometry";
import type { Point } from "./types";

export const LEAST_SCALE = 1;
export const MOST_SCALE = 600;

export class Viewport {
  /** Pixels per metre. */
  scale = 40;
  /** Place in the middle of the stage, in metres. */
  x = 0;
  y = 0;
  width = 800;
  height = 600;

  toPixels(place: Point): Point {
    return {
      x: (place.x - this.x) * this.scale + this.width / 2,
      y: (this.y - place.y) * this.scale + this.height / 2,
    };
  }

  toMetres(pixel: Point): Point {
    return {
      x: (pixel.x - this.width / 2) / this.scale + this.x,
      y: (this.height / 2 - pixel.y) / this.scale + this.y,
    };
  }

  panBy(dx: number, dy: number): void {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
  }

  /** Changes the scale so that what lies under a pixel stays there. */
  zoomAt(pixel: Point, factor: number): void {
    const fixed = this.toMetres(pixel);
    this.scale = Math.min(MOST_SCALE, Math.max(LEAST_SCALE, this.scale * factor));
    const moved = this.toMetres(pixel);
    this.x += fixed.x - moved.x;
    this.y += fixed.y - moved.y;
  }

  fit(box: Box, marginPx = 60, mostScale = 120): void {
    const wide = Math.max(box.right - box.left, 0.5);
    const high = Math.max(box.top - box.bottom, 0.5);
    const room = Math.min(
      Math.max(this.width - 2 * marginPx, 50) / wide,
      Math.max(this.height - 2 * marginPx, 50) / high,
    );
    this.scale = Math.min(mostScale, Math.max(LEAST_SCALE, room));
    this.x = (box.left + box.right) / 2;
    this.y = (box.bottom + box.top) / 2;
  }

  shows(place: Point, marginPx = 40): boolean {
    const { x, y } = this.toPixels(place);
    return (
      x >= marginPx &&
      x <= this.width - marginPx &&
      y >= marginPx &&
      y <= this.height - marginPx
    );
  }
}

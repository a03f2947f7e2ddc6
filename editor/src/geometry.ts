// Plane geometry in metres or pixels.

import type { Point } from "./types";

export const distance = (a: Point, b: Point): number => Math.hypot(b.x - a.x, b.y - a.y);

export const yawFrom = (a: Point, b: Point): number => Math.atan2(b.y - a.y, b.x - a.x);

export const rounded = (value: number, step: number): number => {
  const digits = Math.max(0, Math.round(-Math.log10(step)) + 1);
  return Number((Math.round(value / step) * step).toFixed(digits)) + 0;
};

/** Millimetres: what a file keeps of a position. */
export const tidy = (value: number): number => rounded(value, 0.001);

export function distanceToSegment(point: Point, a: Point, b: Point): number {
  const dx = b.x - a.x;
  const dy = b.y - a.y;
  const squared = dx * dx + dy * dy;
  const share =
    squared === 0 ? 0 : ((point.x - a.x) * dx + (point.y - a.y) * dy) / squared;
  const at = Math.min(1, Math.max(0, share));
  return Math.hypot(point.x - a.x - at * dx, point.y - a.y - at * dy);
}

export interface Box {
  left: number;
  right: number;
  bottom: number;
  top: number;
}

export const boxOf = (points: Iterable<Point>): Box | null => {
  let box: Box | null = null;
  for (const { x, y } of points) {
    if (box === null) box = { left: x, right: x, bottom: y, top: y };
    else {
      box.left = Math.min(box.left, x);
      box.right = Math.max(box.right, x);
      box.bottom = Math.min(box.bottom, y);
      box.top = Math.max(box.top, y);
    }
  }
  return box;
};

export const inside = (point: Point, box: Box): boolean =>
  point.x >= box.left && point.x <= box.right && point.y >= box.bottom && point.y <= box.top;

// Outlines of nodes and edges in pixels.

import type { Kind, Point } from "./types";

const fixed = (value: number): string => value.toFixed(1);

/** A node's outline round the origin: square, triangle, circle or diamond. */
export function nodeOutline(kind: Kind, radius: number): string {
  const r = radius;
  switch (kind) {
    case "room":
      return `M${fixed(-r)} ${fixed(-r)}h${fixed(2 * r)}v${fixed(2 * r)}h${fixed(-2 * r)}z`;
    case "door":
      return `M0 ${fixed(-1.15 * r)}L${fixed(1.1 * r)} ${fixed(0.85 * r)}H${fixed(-1.1 * r)}z`;
    case "open_space":
      return `M0 ${fixed(-1.25 * r)}L${fixed(1.25 * r)} 0L0 ${fixed(1.25 * r)}L${fixed(-1.25 * r)} 0z`;
    default:
      return (
        `M${fixed(-r)} 0a${fixed(r)} ${fixed(r)} 0 1 0 ${fixed(2 * r)} 0` +
        `a${fixed(r)} ${fixed(r)} 0 1 0 ${fixed(-2 * r)} 0z`
      );
  }
}

/** How large nodes of each kind are drawn at a scale. */
export function nodeRadius(kind: Kind, scale: number): number {
  const base = Math.min(9, Math.max(2.4, 2 + scale * 0.085));
  return base * (kind === "room" ? 1 : kind === "hallway" ? 0.72 : 0.85);
}

export interface Line {
  readonly from: Point;
  readonly to: Point;
}

/** The visible part of an edge: between its nodes' rims, to the right when it has a twin. */
export function edgeLine(a: Point, b: Point, rimA: number, rimB: number, hasTwin: boolean): Line {
  const length = Math.hypot(b.x - a.x, b.y - a.y) || 1;
  const ux = (b.x - a.x) / length;
  const uy = (b.y - a.y) / length;
  const aside = hasTwin ? 3.5 : 0;
  const shrink = Math.min(1, (0.45 * length) / Math.max(rimA, rimB, 1));
  // Pixels grow downwards: right of the direction (ux, uy) is (-uy, ux).
  return {
    from: { x: a.x + ux * rimA * shrink - uy * aside, y: a.y + uy * rimA * shrink + ux * aside },
    to: { x: b.x - ux * rimB * shrink - uy * aside, y: b.y - uy * rimB * shrink + ux * aside },
  };
}

/** A line with a filled head at its end. */
export function arrow({ from, to }: Line, head: number): string {
  const length = Math.hypot(to.x - from.x, to.y - from.y);
  if (length < 0.5) return "";
  const ux = (to.x - from.x) / length;
  const uy = (to.y - from.y) / length;
  const h = Math.min(head, length * 0.6);
  const neck = { x: to.x - ux * h, y: to.y - uy * h };
  const half = h * 0.42;
  return (
    `M${fixed(from.x)} ${fixed(from.y)}L${fixed(neck.x)} ${fixed(neck.y)}` +
    `M${fixed(to.x)} ${fixed(to.y)}L${fixed(neck.x - uy * half)} ${fixed(neck.y + ux * half)}` +
    `L${fixed(neck.x + uy * half)} ${fixed(neck.y - ux * half)}z`
  );
}

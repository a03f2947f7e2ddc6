// Snapping: to 5 cm, and in line with other nodes.

import { rounded } from "./geometry";
import type { Graph } from "./graph";
import type { Point } from "./types";
import type { Viewport } from "./viewport";

const GRID_M = 0.05;
const NEAR_PX = 6;

export interface Snapped {
  readonly place: Point;
  /** Nodes that the place is in line with, across and up. */
  readonly guides: readonly { readonly axis: "x" | "y"; readonly with: Point }[];
}

export function snap(
  place: Point,
  graph: Graph,
  view: Viewport,
  without: ReadonlySet<string> = new Set(),
): Snapped {
  const near = NEAR_PX / view.scale;
  const best: { x: Point | null; y: Point | null } = { x: null, y: null };
  const off = { x: near, y: near };
  for (const node of graph.nodes.values()) {
    if (without.has(node.id) || !view.shows(node, 0)) continue;
    for (const axis of ["x", "y"] as const) {
      const away = Math.abs(node[axis] - place[axis]);
      if (away < off[axis]) {
        off[axis] = away;
        best[axis] = node;
      }
    }
  }
  const grid = GRID_M * view.scale >= 2 ? GRID_M : 0.001;
  return {
    place: {
      x: best.x?.x ?? rounded(place.x, grid),
      y: best.y?.y ?? rounded(place.y, grid),
    },
    guides: (["x", "y"] as const).flatMap((axis) => {
      const other = best[axis];
      return other ? [{ axis, with: other }] : [];
    }),
  };
}

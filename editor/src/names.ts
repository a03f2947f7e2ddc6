// Where the names of nodes stand.

import type { MapNode } from "./types";

const NEAR_X_PX = 40;
const NEAR_Y_PX = 11;

/** Nodes whose name stands to their left, as another node is close on their right. */
export function namedToTheLeft(nodes: readonly MapNode[], scale: number): Set<string> {
  const sorted = [...nodes].sort((a, b) => a.x - b.x);
  const found = new Set<string>();
  sorted.forEach((node, position) => {
    for (let next = position + 1; next < sorted.length; next += 1) {
      const other = sorted[next]!;
      if ((other.x - node.x) * scale > NEAR_X_PX) break;
      if (Math.abs(other.y - node.y) * scale < NEAR_Y_PX) {
        found.add(node.id);
        break;
      }
    }
  });
  return found;
}

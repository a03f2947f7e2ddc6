// What lies under a pixel, and what lies next in a direction.

import { type Box, distance, distanceToSegment, inside } from "./geometry";
import type { Graph } from "./graph";
import { edgeLine, nodeRadius } from "./shapes";
import type { MapNode, Point } from "./types";
import type { Viewport } from "./viewport";

const NODE_REACH_PX = 6;
const EDGE_REACH_PX = 6;

export type Picked = { kind: "node" | "edge"; id: string };

export function pickNode(graph: Graph, view: Viewport, pixel: Point): MapNode | null {
  let best: MapNode | null = null;
  let least = Infinity;
  for (const node of graph.nodes.values()) {
    const away = distance(view.toPixels(node), pixel) - nodeRadius(node.kind, view.scale);
    if (away < NODE_REACH_PX && away < least) {
      best = node;
      least = away;
    }
  }
  return best;
}

export function pick(graph: Graph, view: Viewport, pixel: Point): Picked | null {
  const node = pickNode(graph, view, pixel);
  if (node) return { kind: "node", id: node.id };
  let best: Picked | null = null;
  let least = EDGE_REACH_PX;
  for (const edge of graph.edges.values()) {
    const source = graph.nodes.get(edge.source);
    const target = graph.nodes.get(edge.target);
    if (!source || !target) continue;
    const hasTwin = graph.between(edge.target, edge.source) !== undefined;
    const line = edgeLine(view.toPixels(source), view.toPixels(target), 0, 0, hasTwin);
    const away = distanceToSegment(pixel, line.from, line.to);
    if (away < least) {
      best = { kind: "edge", id: edge.id };
      least = away;
    }
  }
  return best;
}

/** Nodes in a box, and edges with both ends in it. */
export function within(graph: Graph, box: Box): { nodes: string[]; edges: string[] } {
  const nodes = [...graph.nodes.values()].filter((node) => inside(node, box));
  const ids = new Set(nodes.map((node) => node.id));
  const edges = [...graph.edges.values()].filter(
    (edge) => ids.has(edge.source) && ids.has(edge.target),
  );
  return { nodes: [...ids], edges: edges.map((edge) => edge.id) };
}

/** The node that lies next in a direction: near, and not far to the side. */
export function nextNode(graph: Graph, from: Point, direction: Point): MapNode | null {
  let best: MapNode | null = null;
  let least = Infinity;
  for (const node of graph.nodes.values()) {
    const dx = node.x - from.x;
    const dy = node.y - from.y;
    const ahead = dx * direction.x + dy * direction.y;
    const aside = Math.abs(dx * direction.y - dy * direction.x);
    if (ahead <= 1e-6 || aside > 2 * ahead) continue;
    const cost = ahead + 2 * aside;
    if (cost < least) {
      best = node;
      least = cost;
    }
  }
  return best;
}

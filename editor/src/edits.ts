// Edits of a map as patches. Nothing here touches the page.

import { distance, tidy, yawFrom } from "./geometry";
import type { Graph, Patch } from "./graph";
import type { Behavior, Kind, MapEdge, MapNode, Point } from "./types";

const SAME_M = 0.002;
const SAME_RAD = 1e-4;

/** The edge from one node to another as straight as it can be. */
export const edgeAlong = (source: MapNode, target: MapNode, behavior: Behavior): MapEdge => ({
  id: edgeId(source.id, target.id),
  source: source.id,
  target: target.id,
  behavior,
  yaw: yawFrom(source, target),
  length: distance(source, target),
});

const edgeId = (source: string, target: string): string => `${source}->${target}`.slice(0, 200);

/** A behaviour that is often right; the server suggests a better one from the geometry. */
export const firstGuess = (source: MapNode, target: MapNode): Behavior => {
  if (source.kind === "room" && target.kind === "door") return "find_door";
  return target.kind === "room" ? "straight" : "corridor_follow";
};

/** An edge after its ends moved: straight ones stay straight, set lengths and yaws stay set. */
export function followed(edge: MapEdge, was: Graph, source: MapNode, target: MapNode): MapEdge {
  const oldSource = was.nodes.get(edge.source);
  const oldTarget = was.nodes.get(edge.target);
  if (!oldSource || !oldTarget) return edge;
  const straight = distance(source, target);
  const isStraight = Math.abs(edge.length - distance(oldSource, oldTarget)) < SAME_M;
  const turned = edge.yaw - yawFrom(oldSource, oldTarget);
  const isAlong = Math.abs(Math.atan2(Math.sin(turned), Math.cos(turned))) < SAME_RAD;
  return {
    ...edge,
    length: isStraight ? straight : Math.max(edge.length, straight),
    yaw: isAlong ? yawFrom(source, target) : edge.yaw,
  };
}

/** New states of nodes, and of the edges at them. */
export function replaceNodes(graph: Graph, label: string, nodes: readonly MapNode[]): Patch {
  const moved = new Map(nodes.map((node) => [node.id, node]));
  const edges = new Map<string, MapEdge>();
  for (const node of nodes) {
    for (const edge of graph.edgesAt(node.id)) {
      const source = moved.get(edge.source) ?? graph.nodes.get(edge.source);
      const target = moved.get(edge.target) ?? graph.nodes.get(edge.target);
      if (source && target) edges.set(edge.id, followed(edge, graph, source, target));
    }
  }
  return graph.patch(label, moved, edges);
}

export function moveNodes(graph: Graph, ids: Iterable<string>, by: Point): Patch {
  const nodes = [...ids].flatMap((id) => {
    const node = graph.nodes.get(id);
    return node ? [{ ...node, x: tidy(node.x + by.x), y: tidy(node.y + by.y) }] : [];
  });
  return replaceNodes(graph, nodes.length === 1 ? "move node" : "move nodes", nodes);
}

export function remove(graph: Graph, nodes: ReadonlySet<string>, edges: ReadonlySet<string>): Patch {
  const gone = new Set(edges);
  for (const node of nodes) for (const edge of graph.edgesAt(node)) gone.add(edge.id);
  const none = (ids: Iterable<string>): [string, null][] => [...ids].map((id) => [id, null]);
  return graph.patch("delete", none(nodes), none(gone));
}

export function setKind(graph: Graph, ids: Iterable<string>, kind: Kind): Patch {
  const nodes = [...ids].flatMap((id) => graph.nodes.get(id) ?? []);
  return graph.patch(
    `make ${kind.replace("_", " ")}`,
    nodes.map((node) => [node.id, { ...node, kind }]),
  );
}

export function setBehavior(graph: Graph, ids: Iterable<string>, behavior: Behavior): Patch {
  const edges = [...ids].flatMap((id) => graph.edges.get(id) ?? []);
  return graph.patch(
    `make ${behavior.replace("_", " ")}`,
    [],
    edges.map((edge) => [edge.id, { ...edge, behavior }]),
  );
}

export function reverse(graph: Graph, ids: Iterable<string>): Patch {
  const wanted = new Map<string, MapEdge | null>();
  for (const id of ids) {
    const edge = graph.edges.get(id);
    if (!edge) continue;
    const source = graph.nodes.get(edge.target);
    const target = graph.nodes.get(edge.source);
    if (!source || !target || graph.between(edge.target, edge.source)) continue;
    if (!wanted.has(id)) wanted.set(id, null);
    const turned = edgeAlong(source, target, edge.behavior);
    wanted.set(turned.id, { ...turned, length: edge.length });
  }
  return graph.patch("reverse", [], wanted);
}

/** A name that no node has: the wish itself, or the wish with a number. */
export function freeName(taken: ReadonlySet<string> | ReadonlyMap<string, unknown>, wish: string): string {
  if (!taken.has(wish)) return wish;
  const stem = wish.replace(/-\d+$/, "").slice(0, 190);
  for (let number = 2; ; number += 1) {
    const name = `${stem}-${number}`;
    if (!taken.has(name)) return name;
  }
}

/** The name that a new node gets from its kind and its room. */
export function nameFor(graph: Graph, kind: Kind, room: string | null): string {
  if (kind === "room") return freeName(graph.nodes, room ?? "room-1");
  if (kind === "door") return freeName(graph.nodes, room ? `${room}_door` : "door-1");
  return freeName(graph.nodes, `${room ?? kind}-1`);
}

/** Gives a node another name; edges that are called after their nodes are called anew. */
export function rename(graph: Graph, id: string, name: string): Patch {
  const node = graph.nodes.get(id);
  if (!node || graph.nodes.has(name)) return graph.patch("rename", []);
  const edges = new Map<string, MapEdge | null>();
  for (const edge of graph.edgesAt(id)) {
    const source = edge.source === id ? name : edge.source;
    const target = edge.target === id ? name : edge.target;
    const isNamedAfter = edge.id === edgeId(edge.source, edge.target);
    const wish = isNamedAfter ? edgeId(source, target) : edge.id;
    const next = wish === edge.id ? wish : freeName(graph.edges, wish);
    if (next !== edge.id) edges.set(edge.id, null);
    edges.set(next, { ...edge, id: next, source, target });
  }
  return graph.patch(
    "rename",
    [
      [id, null],
      [name, { ...node, id: name }],
    ],
    edges,
  );
}

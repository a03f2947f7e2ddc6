// Pieces of maps: what is copied, pasted, and drawn as a whole corridor.

import { edgeAlong, freeName, nameFor } from "./edits";
import { boxOf, tidy, yawFrom } from "./geometry";
import type { Graph, Patch } from "./graph";
import {
  type Behavior,
  BEHAVIORS,
  type Kind,
  KINDS,
  type MapEdge,
  type MapNode,
  type Point,
} from "./types";

const MARK = "toponav-piece";
const MOST_CHARACTERS = 8_000_000;

export interface Piece {
  nodes: MapNode[];
  edges: MapEdge[];
}

export function copyOf(graph: Graph, ids: ReadonlySet<string>): Piece {
  return {
    nodes: [...ids].flatMap((id) => graph.nodes.get(id) ?? []),
    edges: [...graph.edges.values()].filter(
      (edge) => ids.has(edge.source) && ids.has(edge.target),
    ),
  };
}

export const pieceToText = (piece: Piece): string => JSON.stringify({ [MARK]: 1, ...piece });

/** The piece that a text holds, or null: text from elsewhere is nobody's piece. */
export function pieceOfText(text: string): Piece | null {
  if (text.length > MOST_CHARACTERS || !text.startsWith(`{"${MARK}":1`)) return null;
  try {
    const value = JSON.parse(text) as Piece;
    const nodes = value.nodes
      .filter(isNode)
      .map(({ id, kind, x, y, room, size }) => ({ id, kind, x, y, room, size }));
    const ids = new Set(nodes.map((node) => node.id));
    const edges = value.edges.filter(
      (edge) => isEdge(edge) && ids.has(edge.source) && ids.has(edge.target),
    );
    return nodes.length ? { nodes, edges } : null;
  } catch {
    return null;
  }
}

/** A piece put down at a place, with names of its own. */
export function paste(graph: Graph, piece: Piece, at: Point | null): { patch: Patch; ids: string[] } {
  const box = boxOf(piece.nodes);
  const middle = box
    ? { x: (box.left + box.right) / 2, y: (box.bottom + box.top) / 2 }
    : { x: 0, y: 0 };
  const by = at ? { x: at.x - middle.x, y: at.y - middle.y } : { x: 0.5, y: -0.5 };
  const taken = new Set(graph.nodes.keys());
  const names = new Map<string, string>();
  const nodes = piece.nodes.map((node) => {
    const id = freeName(taken, node.id);
    taken.add(id);
    names.set(node.id, id);
    return { ...node, id, x: tidy(node.x + by.x), y: tidy(node.y + by.y) };
  });
  const present = new Map(nodes.map((node) => [node.id, node]));
  const edges = piece.edges.flatMap((edge) => {
    const source = present.get(names.get(edge.source) ?? "");
    const target = present.get(names.get(edge.target) ?? "");
    if (!source || !target) return [];
    return [{ ...edgeAlong(source, target, edge.behavior), length: edge.length }];
  });
  return {
    patch: graph.patch(
      "paste",
      nodes.map((node) => [node.id, node]),
      edges.map((edge) => [edge.id, edge]),
    ),
    ids: nodes.map((node) => node.id),
  };
}

export interface LanePair {
  /** Node of the lane along the direction of drawing, then of the lane against it. */
  readonly along: string;
  readonly against: string;
}

/** Two lanes of a corridor go on to a point, driving on the right; from nowhere, a pair begins. */
export function extendCorridor(
  graph: Graph,
  from: { pair: LanePair; at: Point } | null,
  to: Point,
  options: { laneM: number; room: string | null; kind: Kind; yaw: number },
): { patch: Patch; pair: LanePair } {
  const yaw = from ? yawFrom(from.at, to) : options.yaw;
  const nodes = new Map<string, MapNode>();
  const taken = new Set(graph.nodes.keys());
  const made: string[] = [];
  for (const side of [-1, 1]) {
    const room = options.room;
    const id = freeName(taken, nameFor(graph, options.kind, room));
    taken.add(id);
    made.push(id);
    nodes.set(id, {
      id,
      kind: options.kind,
      x: tidy(to.x - side * options.laneM * Math.sin(yaw)),
      y: tidy(to.y + side * options.laneM * Math.cos(yaw)),
      room,
      size: 1,
    });
  }
  const pair = { along: made[0]!, against: made[1]! };
  const edges: MapEdge[] = [];
  const join = (sourceId: string, targetId: string): void => {
    const source = nodes.get(sourceId) ?? graph.nodes.get(sourceId);
    const target = nodes.get(targetId) ?? graph.nodes.get(targetId);
    if (source && target) edges.push(edgeAlong(source, target, "corridor_follow"));
  };
  if (from) {
    if (graph.edgesAt(from.pair.along).length + graph.edgesAt(from.pair.against).length === 0) {
      for (const [side, id] of [
        [-1, from.pair.along],
        [1, from.pair.against],
      ] as const) {
        const node = graph.nodes.get(id);
        if (!node) continue;
        nodes.set(id, {
          ...node,
          x: tidy(from.at.x - side * options.laneM * Math.sin(yaw)),
          y: tidy(from.at.y + side * options.laneM * Math.cos(yaw)),
        });
      }
    }
    join(from.pair.along, pair.along);
    join(pair.against, from.pair.against);
  }
  return {
    patch: graph.patch("draw corridor", nodes, edges.map((edge) => [edge.id, edge])),
    pair,
  };
}

const isText = (value: unknown): value is string =>
  typeof value === "string" && value.length > 0 && value.length <= 200;
const isNumber = (value: unknown): value is number =>
  typeof value === "number" && Number.isFinite(value) && Math.abs(value) <= 1e6;

function isNode(value: MapNode): boolean {
  return (
    isText(value.id) &&
    KINDS.some((choice) => choice.value === value.kind) &&
    isNumber(value.x) &&
    isNumber(value.y) &&
    (value.room === null || isText(value.room)) &&
    isNumber(value.size) &&
    value.size >= 0.001
  );
}

function isEdge(value: MapEdge): boolean {
  const known: readonly Behavior[] = BEHAVIORS.map((choice) => choice.value);
  return (
    isText(value.id) && known.includes(value.behavior) && isNumber(value.length) && value.length >= 0
  );
}

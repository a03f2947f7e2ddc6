// What a click of each drawing tool does: nodes, edges, corridors, plans.

import { api, type Refused } from "./api";
import type { Editor } from "./editor";
import { edgeAlong, firstGuess, nameFor, setBehavior } from "./edits";
import { distance, tidy } from "./geometry";
import { pickNode } from "./picking";
import { extendCorridor, type LanePair } from "./pieces";
import type { Kind, MapEdge, MapNode, Point, Suggestion } from "./types";

const LANE_M = 0.15;
const SAME_ROOM_M = 8;
const MOST_TURNS = 20;

export class Drafting {
  corridor: { pair: LanePair; at: Point } | null = null;
  /** Edges whose behaviour nobody chose yet. */
  private readonly undecided = new Set<string>();

  constructor(private readonly editor: Editor) {
    editor.on(["tool"], () => {
      if (editor.tool !== "corridor") this.corridor = null;
    });
  }

  newNode(place: Point, kind: Kind = this.editor.kind): MapNode {
    const { graph, rooms } = this.editor;
    let room = rooms.at(place)?.name ?? null;
    if (rooms.all.length === 0) room = this.guessRoom(place, kind);
    const id = nameFor(graph, kind, room);
    if (kind === "room" && room === null) room = id;
    return { id, kind, x: tidy(place.x), y: tidy(place.y), room, size: 1 };
  }

  addNode(place: Point): void {
    const node = this.newNode(place);
    this.editor.do(this.editor.graph.patch("add node", [[node.id, node]]));
    this.editor.select([node.id]);
    this.editor.say(`Added ${node.kind.replace("_", " ")} ${node.id}`);
  }

  /** A click of the edge tool: begins at a node, ends at the next, draws the node if needed. */
  connectAt(place: Point, hit: MapNode | null, bothWays: boolean): void {
    const { editor } = this;
    const source = editor.source ? editor.graph.nodes.get(editor.source) : undefined;
    if (!source) {
      if (hit) {
        editor.setSource(hit.id);
        editor.select([hit.id]);
        editor.say(`Edge from ${hit.id}: choose where it leads`);
      } else editor.say("An edge begins at a node: none is here");
      return;
    }
    if (hit?.id === source.id) {
      editor.setSource(null);
      return;
    }
    const target = hit ?? this.newNode(place);
    this.connect(source, target, bothWays);
    editor.setSource(target.id);
  }

  connect(source: MapNode, target: MapNode, bothWays: boolean): void {
    const { editor } = this;
    const pairs: [MapNode, MapNode][] = [[source, target]];
    if (bothWays) pairs.push([target, source]);
    const edges = pairs
      .filter(([from, to]) => !editor.graph.between(from.id, to.id))
      .map(([from, to]) => {
        const chosen = editor.behavior === "auto" ? firstGuess(from, to) : editor.behavior;
        return edgeAlong(from, to, chosen);
      });
    const isNew = !editor.graph.nodes.has(target.id);
    const patch = editor.graph.patch(
      "connect",
      isNew ? [[target.id, target]] : [],
      edges.map((edge) => [edge.id, edge]),
    );
    if (!editor.do(patch)) {
      editor.say(`${source.id} leads to ${target.id} already`);
      return;
    }
    editor.select([], edges.map((edge) => edge.id));
    editor.say(`Connected ${source.id} to ${target.id}`);
    if (editor.behavior === "auto") void this.decide(edges);
  }

  extend(place: Point): void {
    const { editor } = this;
    const room = editor.rooms.at(place);
    const made = extendCorridor(editor.graph, this.corridor, place, {
      laneM: LANE_M,
      room: room?.name ?? null,
      kind: editor.kind === "open_space" ? "open_space" : "hallway",
      yaw: 0,
    });
    editor.do(made.patch);
    this.corridor = { pair: made.pair, at: place };
    editor.select([made.pair.along, made.pair.against]);
    editor.say(editor.graph.edges.size ? "Corridor goes on" : "Corridor begins");
    const edges = made.patch.edges.flatMap(({ after }) => after ?? []);
    if (edges.length) void this.decide(edges);
  }

  /** A click of the plan tool: the start, then the goal; rooms may be clicked anywhere. */
  async planAt(place: Point, hit: MapNode | null): Promise<void> {
    const { editor } = this;
    const node = hit ?? this.roomNode(place);
    if (!node) {
      editor.say("No room is here");
      return;
    }
    if (editor.source === null || editor.goal !== null) {
      editor.goal = null;
      editor.setSource(node.id);
      editor.setPlans([]);
      editor.say(`Plan from ${node.id}: choose the goal`);
      return;
    }
    editor.goal = node.id;
    await this.plan();
  }

  async plan(): Promise<void> {
    const { editor } = this;
    if (!editor.source || !editor.goal) return;
    try {
      const plans = await api.plans(editor.graph.toDocument(), editor.source, editor.goal);
      editor.setPlans(plans);
      const best = plans[0];
      if (best) editor.say(`Plan of ${best.edges.length} behaviours, ${best.length.toFixed(1)} m`);
    } catch (error) {
      editor.setPlans([]);
      const { message, remedy } = error as Refused;
      editor.say(`${message}. ${remedy}`);
      this.noPlan?.(`${message}. ${remedy}.`);
    }
    editor.emit("tool");
  }
  noPlan?: (reason: string) => void;

  /** The user chose these edges' behaviour: nobody else shall. */
  settle(edges: Iterable<string>): void {
    for (const id of edges) this.undecided.delete(id);
  }

  /** Asks for the behaviours of new edges, and of edges that nobody decided next to them. */
  private async decide(edges: readonly MapEdge[]): Promise<void> {
    const { editor } = this;
    for (const edge of edges) this.undecided.add(edge.id);
    for (let turn = 0; turn < MOST_TURNS; turn += 1) {
      const near = edges
        .filter((edge) => editor.graph.edges.has(edge.id))
        .flatMap((edge) => [
          ...editor.graph.edgesAt(edge.source),
          ...editor.graph.edgesAt(edge.target),
        ]);
      const asked = new Set(near.map((edge) => edge.id).filter((id) => this.undecided.has(id)));
      if (!asked.size) return;
      const { revision } = editor;
      try {
        const found = await api.suggestions(editor.graph.toDocument(), [...asked]);
        // An answer about a map that was edited meanwhile is worth nothing: ask again.
        if (revision !== editor.revision) continue;
        this.apply(found.filter(({ edge }) => this.undecided.has(edge)));
      } catch {
        // The first guess stays; the checks say so if it contradicts the geometry.
      }
      return;
    }
  }

  /** Makes suggestions part of the last edit: one undo takes back both. */
  private apply(found: readonly Suggestion[]): void {
    const { editor } = this;
    for (const { edge, suggested } of found) {
      const done = editor.history.top;
      if (done) editor.amend(done, setBehavior(editor.graph, [edge], suggested));
    }
  }

  private roomNode(place: Point): MapNode | null {
    const { graph, rooms, view } = this.editor;
    const room = rooms.at(place);
    if (!room) return pickNode(graph, view, view.toPixels(place));
    const nodes = [...graph.nodes.values()].filter((node) => node.room === room.name);
    return (
      nodes.find((node) => node.kind === "room") ??
      nodes.sort((a, b) => distance(a, place) - distance(b, place))[0] ??
      null
    );
  }

  /** Without a floor plan: a door belongs to the nearest room. */
  private guessRoom(place: Point, kind: Kind): string | null {
    if (kind !== "door") return null;
    const { graph, nodes } = this.editor;
    const centers = [...graph.nodes.values()].filter((node) => node.kind === "room");
    const selected = centers.find((node) => nodes.has(node.id));
    const nearest = centers.sort((a, b) => distance(a, place) - distance(b, place))[0];
    const chosen = selected ?? nearest;
    return chosen && distance(chosen, place) < SAME_ROOM_M ? chosen.room : null;
  }
}

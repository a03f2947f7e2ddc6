// What the page and the server talk about. Positions are metres in the map's frame, y up.

export type Kind = "room" | "door" | "hallway" | "open_space";
export type Behavior =
  | "corridor_follow"
  | "find_door"
  | "turn_left"
  | "turn_right"
  | "straight";

export interface MapNode {
  readonly id: string;
  readonly kind: Kind;
  readonly x: number;
  readonly y: number;
  readonly room: string | null;
  readonly size: number;
}

export interface MapEdge {
  readonly id: string;
  readonly source: string;
  readonly target: string;
  readonly behavior: Behavior;
  readonly yaw: number;
  readonly length: number;
}

export interface MapDocument {
  version: number;
  name: string;
  frame: { name: string; plan: string | null };
  nodes: MapNode[];
  edges: MapEdge[];
}

export interface Room {
  name: string;
  kind: string;
  enclosed: boolean;
  at: [number, number] | null;
}

export interface FloorDocument {
  extent: [number, number, number, number];
  rooms: Room[];
  cells: { rows: number; cols: number; side: number; data: string } | null;
}

export interface Opened {
  map: MapDocument;
  version: string;
  file: string;
  floor: FloorDocument | null;
  can_construct: boolean;
}

export interface Fault {
  rule: string;
  paper_rule: number | null;
  severity: "error" | "warning";
  element: string;
  place: [number, number] | null;
  message: string;
  remedy: string;
  fixable: boolean;
}

export interface Suggestion {
  edge: string;
  behavior: Behavior;
  suggested: Behavior;
}

export interface Plan {
  nodes: string[];
  edges: string[];
  length: number;
  difficulty: string;
  behaviors: { behavior: Behavior; count: number }[];
}

export interface Point {
  readonly x: number;
  readonly y: number;
}

interface Choice<Value> {
  value: Value;
  label: string;
  key: string;
}

export const KINDS: readonly Choice<Kind>[] = [
  { value: "room", label: "Room", key: "r" },
  { value: "door", label: "Door", key: "d" },
  { value: "hallway", label: "Hallway", key: "h" },
  { value: "open_space", label: "Open space", key: "o" },
];

export const BEHAVIORS: readonly Choice<Behavior>[] = [
  { value: "corridor_follow", label: "Corridor follow", key: "1" },
  { value: "find_door", label: "Find door", key: "2" },
  { value: "turn_left", label: "Turn left", key: "3" },
  { value: "turn_right", label: "Turn right", key: "4" },
  { value: "straight", label: "Straight", key: "5" },
];

export const labelOf = (value: Kind | Behavior): string =>
  [...KINDS, ...BEHAVIORS].find((choice) => choice.value === value)?.label ?? value;

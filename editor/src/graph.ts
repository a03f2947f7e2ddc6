// The map that is edited, and the only way to change it: patches that can be undone.

import type { MapDocument, MapEdge, MapNode } from "./types";

export interface Change<Element> {
  readonly id: string;
  readonly before: Element | null;
  readonly after: Element | null;
}

export interface Patch {
  readonly label: string;
  readonly nodes: readonly Change<MapNode>[];
  readonly edges: readonly Change<MapEdge>[];
}

export const isEmpty = (patch: Patch): boolean =>
  patch.nodes.length === 0 && patch.edges.length === 0;

export const inverse = (patch: Patch): Patch => {
  const turned = <Element>(changes: readonly Change<Element>[]): Change<Element>[] =>
    changes.map(({ id, before, after }) => ({ id, before: after, after: before }));
  return { label: patch.label, nodes: turned(patch.nodes), edges: turned(patch.edges) };
};

/** One patch that does what two in a row do. */
export function joined(first: Patch, second: Patch): Patch {
  return {
    label: first.label,
    nodes: joinedChanges(first.nodes, second.nodes),
    edges: joinedChanges(first.edges, second.edges),
  };
}

function joinedChanges<Element>(
  first: readonly Change<Element>[],
  second: readonly Change<Element>[],
): Change<Element>[] {
  const all = new Map(first.map((change) => [change.id, change]));
  for (const change of second) {
    const earlier = all.get(change.id);
    all.set(change.id, earlier ? { ...change, before: earlier.before } : change);
  }
  return [...all.values()].filter(({ before, after }) => before !== null || after !== null);
}

const sameElement = <Element extends object>(one: Element | null, other: Element | null): boolean =>
  one === other ||
  (one !== null &&
    other !== null &&
    Object.entries(one).every(([key, value]) => Object.is(value, other[key as keyof Element])));

export class Graph {
  readonly nodes = new Map<string, MapNode>();
  readonly edges = new Map<string, MapEdge>();
  private readonly leaving = new Map<string, Set<string>>();
  private readonly entering = new Map<string, Set<string>>();

  constructor(
    readonly name: string,
    readonly frame: MapDocument["frame"],
    nodes: readonly MapNode[] = [],
    edges: readonly MapEdge[] = [],
  ) {
    for (const node of nodes) this.setNode(node.id, node);
    for (const edge of edges) this.setEdge(edge.id, edge);
  }

  static of(document: MapDocument): Graph {
    return new Graph(document.name, document.frame, document.nodes, document.edges);
  }

  toDocument(): MapDocument {
    return {
      version: 1,
      name: this.name,
      frame: this.frame,
      nodes: [...this.nodes.values()],
      edges: [...this.edges.values()],
    };
  }

  outEdges(node: string): MapEdge[] {
    return this.listed(this.leaving.get(node));
  }

  inEdges(node: string): MapEdge[] {
    return this.listed(this.entering.get(node));
  }

  edgesAt(node: string): MapEdge[] {
    const touching = new Set([...this.outEdges(node), ...this.inEdges(node)]);
    return [...touching];
  }

  between(source: string, target: string): MapEdge | undefined {
    return this.outEdges(source).find((edge) => edge.target === target);
  }

  /** Does a patch, whatever order its changes come in; edges leave before their nodes do. */
  apply(patch: Patch): void {
    for (const { id, after } of patch.edges) if (after === null) this.setEdge(id, null);
    for (const { id, after } of patch.nodes) this.setNode(id, after);
    for (const { id, after } of patch.edges) if (after !== null) this.setEdge(id, after);
  }

  /** A patch from the elements as they shall be; null removes one. */
  patch(
    label: string,
    nodes: Iterable<readonly [string, MapNode | null]>,
    edges: Iterable<readonly [string, MapEdge | null]> = [],
  ): Patch {
    const changes = <Element extends object>(
      present: Map<string, Element>,
      wanted: Iterable<readonly [string, Element | null]>,
    ): Change<Element>[] =>
      [...new Map(wanted)]
        .map(([id, after]) => ({ id, before: present.get(id) ?? null, after }))
        .filter(({ before, after }) => !sameElement(before, after));
    return { label, nodes: changes(this.nodes, nodes), edges: changes(this.edges, edges) };
  }

  private listed(ids: Set<string> | undefined): MapEdge[] {
    return [...(ids ?? [])].flatMap((id) => this.edges.get(id) ?? []);
  }

  private setNode(id: string, node: MapNode | null): void {
    if (node === null) this.nodes.delete(id);
    else this.nodes.set(id, node);
  }

  private setEdge(id: string, edge: MapEdge | null): void {
    const old = this.edges.get(id);
    if (old) {
      this.leaving.get(old.source)?.delete(id);
      this.entering.get(old.target)?.delete(id);
    }
    if (edge === null) {
      this.edges.delete(id);
      return;
    }
    this.edges.set(id, edge);
    for (const [index, node] of [
      [this.leaving, edge.source],
      [this.entering, edge.target],
    ] as const) {
      const ids = index.get(node) ?? new Set();
      index.set(node, ids.add(id));
    }
  }
}

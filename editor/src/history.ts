// Undo and redo without a limit: every edit is a patch, and patches can be turned round.

import { type Graph, inverse, isEmpty, joined, type Patch } from "./graph";

const MERGE_MS = 900;

export class History {
  private done: Patch[] = [];
  private undone: Patch[] = [];
  private mergeKey = "";
  private mergeUntil = 0;

  constructor(private readonly graph: Graph) {}

  get undoLabel(): string | null {
    return this.done.at(-1)?.label ?? null;
  }

  get redoLabel(): string | null {
    return this.undone.at(-1)?.label ?? null;
  }

  get top(): Patch | undefined {
    return this.done.at(-1);
  }

  /** Does an edit. Edits with the same key in quick succession become one. */
  do(patch: Patch, mergeKey = ""): boolean {
    if (isEmpty(patch)) return false;
    this.graph.apply(patch);
    const now = performance.now();
    const last = this.done.at(-1);
    if (last && mergeKey !== "" && mergeKey === this.mergeKey && now < this.mergeUntil) {
      this.done[this.done.length - 1] = joined(last, patch);
    } else {
      this.done.push(patch);
    }
    this.mergeKey = mergeKey;
    this.mergeUntil = now + MERGE_MS;
    this.undone = [];
    return true;
  }

  /** Adds to the edit that was done last, if it still is the last one. */
  amend(last: Patch, patch: Patch): Patch | null {
    if (this.done.at(-1) !== last || isEmpty(patch)) return null;
    this.graph.apply(patch);
    const whole = joined(last, patch);
    this.done[this.done.length - 1] = whole;
    return whole;
  }

  undo(): Patch | null {
    return this.move(this.done, this.undone);
  }

  redo(): Patch | null {
    const patch = this.undone.pop();
    if (!patch) return null;
    this.graph.apply(patch);
    this.done.push(patch);
    this.mergeKey = "";
    return patch;
  }

  private move(from: Patch[], to: Patch[]): Patch | null {
    const patch = from.pop();
    if (!patch) return null;
    const back = inverse(patch);
    this.graph.apply(back);
    to.push(patch);
    this.mergeKey = "";
    return back;
  }
}

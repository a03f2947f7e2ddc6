// Which room lies where, from the cells that the server sent.

import { type Box, boxOf } from "./geometry";
import type { FloorDocument, Point, Room } from "./types";

export class Rooms {
  readonly all: readonly Room[];
  readonly extent: FloorDocument["extent"] | null;
  private readonly cells: FloorDocument["cells"];
  private readonly numbers: Int16Array;

  constructor(floor: FloorDocument | null) {
    this.all = floor?.rooms ?? [];
    this.extent = floor?.extent ?? null;
    this.cells = floor?.cells ?? null;
    const bytes = Uint8Array.from(atob(this.cells?.data ?? ""), (letter) => letter.charCodeAt(0));
    this.numbers = new Int16Array(bytes.buffer);
  }

  /** What the rooms cover, or the whole plan where no rooms are known. */
  get covered(): Box | null {
    if (!this.extent) return null;
    const [left, right, bottom, top] = this.extent;
    if (!this.cells) return { left, right, bottom, top };
    const { cols, side } = this.cells;
    const corners: Point[] = [];
    this.numbers.forEach((number, cell) => {
      if (number < 0) return;
      const [col, row] = [cell % cols, Math.floor(cell / cols)];
      corners.push({ x: left + (col + 0.5) * side, y: bottom + (row + 0.5) * side });
    });
    return boxOf(corners) ?? { left, right, bottom, top };
  }

  at(place: Point): Room | null {
    if (!this.cells || !this.extent) return null;
    const { rows, cols, side } = this.cells;
    const col = Math.floor((place.x - this.extent[0]) / side);
    const row = Math.floor((place.y - this.extent[2]) / side);
    if (col < 0 || row < 0 || col >= cols || row >= rows) return null;
    return this.all[this.numbers[row * cols + col] ?? -1] ?? null;
  }
}

"""Grows rooms inside an outline, as in Lopes et al. 2010, "A constrained growth method".

Everything here is on coarse cells of a quarter metre; `OUTSIDE` is no room.
"""

import numpy as np
from jaxtyping import Bool, Int16
from scipy import ndimage

from toponav.core.vocabulary import RoomKind
from toponav.worlds.generate._home_program import RoomSpec

__all__ = ["COARSE_M", "OUTSIDE", "Labels", "grow_plan"]

COARSE_M = 0.25
OUTSIDE, _FREE = -1, -2
_MARGIN = 2

Labels = Int16[np.ndarray, "coarse_rows coarse_cols"]
Rect = tuple[int, int, int, int]  # row0, col0, row1, col1; ends exclusive


def grow_plan(rng: np.random.Generator, specs: tuple[RoomSpec, ...]) -> Labels:
    """One candidate: the number of the room in each cell; not every one is a good home."""
    labels = np.where(_outline(rng, specs), _FREE, OUTSIDE).astype(np.int16)
    if rng.random() < 0.5:
        labels = np.ascontiguousarray(labels.T)
    for number, spec in enumerate(specs):
        if spec.kind is RoomKind.HALLWAY:
            _lay_hallway(rng, labels, number, spec.area_m2)
    boxes = _plant(rng, labels, specs)
    targets = {number: specs[number].area_m2 / COARSE_M**2 for number in boxes}
    _grow_rectangles(rng, labels, boxes, targets, 1.0)
    _grow_rectangles(rng, labels, boxes, targets, 1.6)
    _share_leftovers(labels, specs)
    return labels


def _outline(
    rng: np.random.Generator, specs: tuple[RoomSpec, ...]
) -> Bool[np.ndarray, "coarse_rows coarse_cols"]:
    """A rectangle with up to two corners cut away, as large as the rooms together."""
    area = sum(spec.area_m2 for spec in specs) / COARSE_M**2
    cuts = int(rng.choice(3, p=(0.6, 0.4, 0.0) if len(specs) < 5 else (0.25, 0.45, 0.3)))
    shares = [(rng.uniform(0.22, 0.48), rng.uniform(0.18, 0.45)) for _ in range(cuts)]
    area /= 1.0 - sum(wide * tall for wide, tall in shares)
    aspect = float(rng.uniform(1.0, 1.45) if len(specs) < 5 else rng.uniform(1.15, 1.8))
    cols = round(np.sqrt(area * aspect))
    rows = round(area / cols)
    inside = np.ones((rows, cols), dtype=bool)
    corners = rng.permutation(4)
    for corner, (wide, tall) in zip(corners, shares, strict=False):
        cut_rows, cut_cols = round(tall * rows), round(wide * cols)
        row = 0 if corner % 2 == 0 else rows - cut_rows
        col = 0 if corner // 2 == 0 else cols - cut_cols
        inside[row : row + cut_rows, col : col + cut_cols] = False
    return np.pad(inside, _MARGIN)


def _lay_hallway(rng: np.random.Generator, labels: Labels, number: int, area_m2: float) -> None:
    """A strip along the long side, often with a branch to an outer wall."""
    rows, cols = labels.shape
    wide = rows > cols
    grid = labels.T if wide else labels
    rows, cols = grid.shape
    width = int(rng.integers(5, 7))
    length = min(round(area_m2 / COARSE_M**2 / width), round(0.75 * cols))
    low = round(rows * rng.uniform(0.34, 0.66)) - width // 2
    start = int(rng.integers(_MARGIN, cols - _MARGIN - length + 1))
    if rng.random() < 0.4:
        start = _MARGIN if rng.random() < 0.5 else cols - _MARGIN - length
    _paint(grid, (low, start, low + width, start + length), number)
    if rng.random() < 0.5:
        branch = int(rng.integers(start, start + length - width + 1))
        up = rng.random() < 0.5
        span = (low, rows) if up else (0, low)
        if span[1] - span[0] <= round(5.5 / COARSE_M):
            _paint(grid, (span[0], branch, span[1], branch + width), number)


def _paint(grid: Labels, rect: Rect, number: int) -> None:
    row0, col0, row1, col1 = rect
    window = grid[row0:row1, col0:col1]
    window[window == _FREE] = number


def _plant(
    rng: np.random.Generator, labels: Labels, specs: tuple[RoomSpec, ...]
) -> dict[int, list[int]]:
    """A small first rectangle for each room: public ones together, the rest by the hallway."""
    boxes: dict[int, list[int]] = {}
    planted: list[tuple[int, int]] = []
    public: list[tuple[int, int]] = []
    hall = np.isin(labels, [n for n, s in enumerate(specs) if s.kind is RoomKind.HALLWAY])
    to_hall = ndimage.distance_transform_edt(~hall) if hall.any() else np.zeros(labels.shape)
    for number, spec in enumerate(specs):
        if spec.kind is RoomKind.HALLWAY:
            continue
        room_to_edge = ndimage.distance_transform_cdt(labels == _FREE, "chessboard")
        cells = np.argwhere(room_to_edge >= 3)
        if len(cells) == 0:
            cells = np.argwhere(labels == _FREE)
        if len(cells) == 0:
            return boxes
        size = np.sqrt(spec.area_m2) / COARSE_M
        gaps = _distances(cells, planted)
        worth = np.minimum(gaps / size, 1.3) - 0.1 * np.abs(gaps - size) / size
        worth -= 0.6 * np.clip(to_hall[tuple(cells.T)] / size - 0.7, 0.0, 2.0)
        if public and spec.is_public:
            worth -= 0.5 * _distances(cells, public) / size
        elif public:
            worth += 0.12 * np.minimum(_distances(cells, public) / size, 3.0)
        row, col = cells[int(np.argmax(worth + rng.gumbel(scale=0.16, size=len(cells))))].tolist()
        planted.append((row, col))
        if spec.is_public:
            public.append((row, col))
        boxes[number] = _first_box(labels, row, col, number)
    return boxes


def _distances(cells: np.ndarray, points: list[tuple[int, int]]) -> np.ndarray:
    """From each cell to the nearest point; far when there is none."""
    if not points:
        return np.full(len(cells), 40.0)
    away = cells[:, None, :] - np.array(points)[None]
    nearest: np.ndarray = np.hypot(away[..., 0], away[..., 1]).min(axis=1)
    return nearest


def _first_box(labels: Labels, row: int, col: int, number: int) -> list[int]:
    box = [row, col, row + 1, col + 1]
    labels[row, col] = number
    for _ in range(3):
        for side in range(4):
            if _line_is_free(labels, box, side):
                _extend(labels, box, side, number)
    return box


def _line(box: list[int], side: int) -> tuple[slice, slice]:
    """The cells that extending a rectangle to one side would add."""
    row0, col0, row1, col1 = box
    return (
        (slice(row0 - 1, row0), slice(col0, col1)),
        (slice(row0, row1), slice(col0 - 1, col0)),
        (slice(row1, row1 + 1), slice(col0, col1)),
        (slice(row0, row1), slice(col1, col1 + 1)),
    )[side]


def _line_is_free(labels: Labels, box: list[int], side: int) -> bool:
    return bool((labels[_line(box, side)] == _FREE).all())


def _extend(labels: Labels, box: list[int], side: int, number: int) -> None:
    labels[_line(box, side)] = number
    box[side] += 1 if side >= 2 else -1


def _grow_rectangles(
    rng: np.random.Generator,
    labels: Labels,
    boxes: dict[int, list[int]],
    targets: dict[int, float],
    most: float,
) -> None:
    """Extends rectangles line by line until each holds `most` times its target or is stuck."""
    active = sorted(boxes)
    # A side that meets something never becomes free again.
    open_sides = {number: [0, 1, 2, 3] for number in active}
    while active:
        shares = np.array([targets[number] for number in active])
        number = active[int(rng.choice(len(active), p=shares / shares.sum()))]
        box = boxes[number]
        tall, wide = box[2] - box[0], box[3] - box[1]
        sides = [side for side in open_sides[number] if _line_is_free(labels, box, side)]
        open_sides[number] = sides
        # A rectangle twice as long as wide grows only in width, while it can.
        if tall > 1.5 * wide and any(side % 2 for side in sides):
            sides = [side for side in sides if side % 2]
        elif wide > 1.5 * tall and any(side % 2 == 0 for side in sides):
            sides = [side for side in sides if side % 2 == 0]
        if not sides or tall * wide >= most * targets[number]:
            active.remove(number)
            continue
        _extend(labels, box, sides[int(rng.integers(len(sides)))], number)


def _share_leftovers(labels: Labels, specs: tuple[RoomSpec, ...]) -> None:
    """Gives cells that no rectangle took to the room along most of their edge, or outside."""
    while True:
        pieces, count = ndimage.label(labels == _FREE)
        if count == 0:
            return
        for piece in range(1, count + 1):
            mask = pieces == piece
            best, share = _best_neighbor(labels, mask, specs)
            labels[mask] = best if share > 0 else OUTSIDE


def _best_neighbor(
    labels: Labels, mask: np.ndarray, specs: tuple[RoomSpec, ...]
) -> tuple[int, float]:
    """The room to which a piece of free cells belongs, and how much of its edge it shares."""
    votes: dict[int, float] = {}
    for shift in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        beside = np.roll(mask, shift, (0, 1)) & ~mask
        for number, count in zip(*np.unique(labels[beside], return_counts=True), strict=True):
            votes[int(number)] = votes.get(int(number), 0.0) + float(count)
    total = sum(votes.values())
    area = float(mask.sum())

    def worth(number: int) -> float:
        if number == OUTSIDE:
            # Leftovers at the outline make it irregular.
            return votes[number] / total * (1.0 if area * COARSE_M**2 > 1.5 else 0.5)
        small = specs[number].kind in (RoomKind.BATHROOM, RoomKind.STORAGE)
        return votes[number] / total * (0.7 if small else 1.0)

    best = max(sorted(votes), key=worth)
    return (best, votes[best] / total) if best != OUTSIDE else (OUTSIDE, 0.0)

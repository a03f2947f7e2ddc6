"""Centre lines of hallways: the skeleton of their floor, pruned and drawn with a ruler."""

import itertools
import math
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage
from skimage.morphology import remove_small_holes, skeletonize

__all__ = ["Lines", "center_lines"]

_PILLAR_M2 = 2.5
"""Solid islands up to this size do not make a hallway two."""
_SPUR_M = 1.2
"""A side branch must reach this much farther than the walls of the hallway it leaves."""
_RULER_M = 0.45
"""Centre lines are straight as far as they stay this close to the skeleton."""
_CORNER_M = 1.8
"""Bends with a piece shorter than this between them are one."""
_MERGE_M = 1.3
"""Junctions closer than this are one."""


@dataclass
class Lines:
    """Straight centre lines: points in metres, and pieces between two of them."""

    points: list[tuple[float, float]] = field(default_factory=list)
    pieces: list[tuple[int, int]] = field(default_factory=list)

    def add(self, x_m: float, y_m: float) -> int:
        """The number of a new point."""
        self.points.append((x_m, y_m))
        return len(self.points) - 1

    def split(self, piece: int, x_m: float, y_m: float) -> int:
        """The number of a new point that divides a piece in two."""
        start, end = self.pieces[piece]
        middle = self.add(x_m, y_m)
        self.pieces[piece] = (start, middle)
        self.pieces.append((middle, end))
        return middle


@dataclass
class _Path:
    """Skeleton cells from one junction or end to another."""

    start: int
    end: int
    cells: list[tuple[int, int]]


def center_lines(
    floor: Bool[np.ndarray, "rows cols"],
    resolution_m: float,
    origin_m: tuple[float, float],
) -> Lines:
    """Straight lines down the middle of a floor, without spurs into corners and niches.

    Args:
        floor: Cells of the hallways.
        resolution_m: Side of a cell.
        origin_m: Position of the lower-left corner of cell (0, 0).
    """
    padded = np.pad(floor, 2)
    pillar = max(1, round(_PILLAR_M2 / resolution_m**2))
    whole = remove_small_holes(padded, max_size=pillar, connectivity=2)
    clearance_m = ndimage.distance_transform_edt(whole) * resolution_m
    lines = Lines()
    pieces, count = ndimage.label(whole)
    for number in range(1, count + 1):
        part = pieces == number
        skeleton = skeletonize(part)  # type: ignore[no-untyped-call]
        paths = _prune(_trace(skeleton), clearance_m, resolution_m)
        if paths:
            _rule(lines, paths, clearance_m, resolution_m)
        else:
            row, col = np.unravel_index(np.argmax(np.where(part, clearance_m, -1)), part.shape)
            lines.add((float(col) + 0.5) * resolution_m, (float(row) + 0.5) * resolution_m)
    left, low = (origin - 2 * resolution_m for origin in origin_m)
    lines.points = [(x_m + left, y_m + low) for x_m, y_m in lines.points]
    return lines


def _trace(skeleton: Bool[np.ndarray, "rows cols"]) -> list[_Path]:
    """The skeleton as paths between the cells that do not have two neighbours."""
    cells = [(int(row), int(col)) for row, col in np.argwhere(skeleton)]
    here = set(cells)
    near: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for row, col in cells:
        straight = [(row + 1, col), (row - 1, col), (row, col + 1), (row, col - 1)]
        found = [cell for cell in straight if cell in here]
        for up, right in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            if (row + up, col + right) in here and not (
                (row + up, col) in here or (row, col + right) in here
            ):
                found.append((row + up, col + right))
        near[row, col] = found
    hubs = {cell: number for number, cell in enumerate(c for c in cells if len(near[c]) != 2)}
    if not hubs and cells:
        hubs[cells[0]] = 0
    paths = []
    taken: set[tuple[tuple[int, int], tuple[int, int]]] = set()
    for hub, number in hubs.items():
        for step in near[hub]:
            if (hub, step) in taken:
                continue
            walk = [hub, step]
            while walk[-1] not in hubs:
                walk.append(next(cell for cell in near[walk[-1]] if cell != walk[-2]))
            taken.add((walk[-1], walk[-2]))
            taken.add((hub, step))
            paths.append(_Path(number, hubs[walk[-1]], walk))
    return paths


def _prune(
    paths: list[_Path], clearance_m: Float[np.ndarray, "rows cols"], cell_m: float
) -> list[_Path]:
    """The paths without short dead ends; what is left of a broken junction becomes one path."""
    paths = _joined(paths)
    while True:
        degree = _degrees(paths)
        worst, worst_m = None, math.inf
        for path in paths:
            loose = [end for end in (path.start, path.end) if degree[end] == 1]
            if len(loose) != 1:
                if len(loose) == 2 and _length_m(path, cell_m) < _SPUR_M:
                    return []
                continue
            root = path.cells[-1] if loose[0] == path.start else path.cells[0]
            length_m = _length_m(path, cell_m)
            if length_m < float(clearance_m[root]) + _SPUR_M and length_m < worst_m:
                worst, worst_m = path, length_m
        if worst is None:
            return paths
        paths = _joined([path for path in paths if path is not worst])


def _degrees(paths: list[_Path]) -> dict[int, int]:
    degree: dict[int, int] = {}
    for path in paths:
        for end in (path.start, path.end):
            degree[end] = degree.get(end, 0) + 1
    return degree


def _joined(paths: list[_Path]) -> list[_Path]:
    """The same lines with two paths that meet at a point of no others made one."""
    paths = list(paths)
    while True:
        at: dict[int, list[_Path]] = {}
        for path in paths:
            at.setdefault(path.start, []).append(path)
            at.setdefault(path.end, []).append(path)
        meeting = next(
            (n for n, own in at.items() if len(own) == 2 and own[0] is not own[1]), None
        )
        if meeting is None:
            return paths
        first, second = at[meeting]
        head = first if first.end == meeting else _turned(first)
        tail = second if second.start == meeting else _turned(second)
        paths = [path for path in paths if path is not first and path is not second]
        paths.append(_Path(head.start, tail.end, head.cells + tail.cells[1:]))


def _turned(path: _Path) -> _Path:
    return _Path(path.end, path.start, path.cells[::-1])


def _length_m(path: _Path, cell_m: float) -> float:
    steps = np.diff(np.array(path.cells, dtype=float), axis=0)
    return float(np.hypot(steps[:, 0], steps[:, 1]).sum()) * cell_m


def _rule(
    lines: Lines,
    paths: list[_Path],
    clearance_m: Float[np.ndarray, "rows cols"],
    cell_m: float,
) -> None:
    """Adds the paths as straight pieces, with close junctions merged."""
    cell_of: dict[int, tuple[int, int]] = {}
    for path in paths:
        cell_of[path.start], cell_of[path.end] = path.cells[0], path.cells[-1]
    group = {number: number for number in cell_of}

    def root(number: int) -> int:
        while group[number] != number:
            number = group[number]
        return number

    degree = _degrees(paths)
    kept = []
    for path in sorted(paths, key=lambda path: _length_m(path, cell_m)):
        short = _length_m(path, cell_m) < _MERGE_M
        if short and degree[path.start] > 2 and degree[path.end] > 2:
            group[root(path.start)] = root(path.end)
        else:
            kept.append(path)
    members: dict[int, list[tuple[int, int]]] = {}
    for number, cell in cell_of.items():
        members.setdefault(root(number), []).append(cell)
    number_of = {
        key: lines.add(*(np.array(cells, dtype=float).mean(axis=0)[::-1] + 0.5) * cell_m)
        for key, cells in members.items()
    }
    for path in kept:
        start, end = number_of[root(path.start)], number_of[root(path.end)]
        walk = (np.array(path.cells, dtype=float)[:, ::-1] + 0.5) * cell_m
        walk[0], walk[-1] = lines.points[start], lines.points[end]
        corners = _straightened(walk)
        inner = [lines.add(float(x_m), float(y_m)) for x_m, y_m in corners[1:-1]]
        chain = [start, *inner, end]
        lines.pieces += [(a, b) for a, b in itertools.pairwise(chain) if a != b]


def _straightened(walk: Float[np.ndarray, "points 2"]) -> Float[np.ndarray, "corners 2"]:
    """Corners of a walk drawn with a ruler; a rounded or cut-off corner becomes one."""
    corners = [np.asarray(point) for point in _simplified(walk, _RULER_M)]
    at = 1
    while at < len(corners) - 2:
        before, here, after, behind = corners[at - 1 : at + 3]
        if np.hypot(*(after - here)) < _CORNER_M:
            meet = _crossing(before, here, after, behind)
            middle = (here + after) / 2
            if meet is None or np.hypot(*(meet - middle)) > _CORNER_M:
                meet = middle
            corners[at : at + 2] = [meet]
            at = max(1, at - 1)
        else:
            at += 1
    kept = np.array(corners)
    return np.array(_simplified(kept, _RULER_M / 2))


def _simplified(
    walk: Float[np.ndarray, "points 2"], tolerance_m: float
) -> list[Float[np.ndarray, "2"]]:
    """Douglas and Peucker's choice of points: the rest lies this close to their lines."""
    keep = np.zeros(len(walk), bool)
    keep[[0, -1]] = True
    spans = [(0, len(walk) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        along = walk[last] - walk[first]
        offset = walk[first + 1 : last] - walk[first]
        length = float(np.hypot(*along))
        if length < 1e-9:
            away = np.hypot(offset[:, 0], offset[:, 1])
        else:
            away = np.abs(offset[:, 0] * along[1] - offset[:, 1] * along[0]) / length
        worst = int(away.argmax())
        if away[worst] > tolerance_m:
            middle = first + 1 + worst
            keep[middle] = True
            spans += [(first, middle), (middle, last)]
    return list(walk[keep])


def _crossing(
    a: Float[np.ndarray, "2"],
    b: Float[np.ndarray, "2"],
    c: Float[np.ndarray, "2"],
    d: Float[np.ndarray, "2"],
) -> Float[np.ndarray, "2"] | None:
    """Where the line through a and b meets the one through c and d; None if about parallel."""
    first, second = b - a, d - c
    cross = float(first[0] * second[1] - first[1] * second[0])
    if abs(cross) < 0.3 * float(np.hypot(*first) * np.hypot(*second)):
        return None
    offset = c - a
    share = float(offset[0] * second[1] - offset[1] * second[0]) / cross
    return np.asarray(a + share * first)

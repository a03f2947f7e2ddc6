"""Where the hallways of a building run: straight runs on a jittered lattice, in cells."""

from dataclasses import dataclass, field

import numpy as np

__all__ = ["CELL_M", "Run", "Skeleton", "Stop", "draw_skeleton"]

CELL_M = 0.05

_EXTENT_M = {
    "small": ((24.0, 34.0), (18.0, 26.0)),
    "medium": ((30.0, 48.0), (22.0, 36.0)),
    "large": ((42.0, 60.0), (30.0, 50.0)),
}
_HALLWAY_M = {"small": (20.0, 36.0), "medium": (38.0, 70.0), "large": (72.0, 120.0)}
_ROOM_DEPTH_M = 6.5


@dataclass
class Stop:
    """Where a run meets other runs, or ends.

    Attributes:
        along: Position on the run, in cells.
        junction: Index of the junction.
        reach_m: Distance from here at which turns begin, towards lower and higher `along`.
    """

    along: int
    junction: int
    reach_m: tuple[float, float] = (0.0, 0.0)


@dataclass
class Run:
    """A straight hallway or open space; `along` is x where it is horizontal, else y.

    Attributes:
        horizontal: Whether it runs along x.
        across: Its axis, in cells.
        half: Half of its width, in cells.
        is_open: Whether it is an open space rather than a hallway.
        stops: Junctions on it in rising order; the first and the last are its ends.
        extend: How far its floor goes past its first and last stop, in cells.
        name: Room name, given later.
    """

    horizontal: bool
    across: int
    half: int
    is_open: bool
    stops: list[Stop]
    extend: tuple[int, int] = (0, 0)
    name: str = ""

    @property
    def low(self) -> int:
        """First cell of its floor."""
        return self.stops[0].along - self.extend[0]

    @property
    def high(self) -> int:
        """One past the last cell of its floor."""
        return self.stops[-1].along + self.extend[1]

    def box(self, along: tuple[int, int], across: tuple[int, int]) -> tuple[slice, slice]:
        """Rows and columns of a rectangle given along and across the run."""
        if self.horizontal:
            return slice(*across), slice(*along)
        return slice(*along), slice(*across)

    def floor(self) -> tuple[slice, slice]:
        """Rows and columns of its floor."""
        return self.box((self.low, self.high), (self.across - self.half, self.across + self.half))


@dataclass
class Skeleton:
    """All runs of a building and its junctions as (col, row), in cells."""

    runs: list[Run]
    junctions: list[tuple[int, int]]
    rows: int
    cols: int
    arms: dict[int, list[tuple[int, int]]] = field(default_factory=dict)

    def is_dead_end(self, junction: int) -> bool:
        """Whether only one passage leads there."""
        return len(self.arms[junction]) == 1


Point = tuple[int, int]
Link = tuple[Point, Point]


def draw_skeleton(rng: np.random.Generator, size: str) -> Skeleton:
    """A connected set of hallways: lines, bends, T and + junctions, loops, open spaces."""
    width_m, height_m = (rng.uniform(*bounds) for bounds in _EXTENT_M[size])
    columns, rows = _line_counts(rng, size)
    xs = _positions(rng, width_m, columns)
    ys = _positions(rng, height_m, rows)
    links = _grow(rng, xs, ys, rng.uniform(*_HALLWAY_M[size]))
    flip = bool(rng.random() < 0.5)
    if flip:
        xs, ys = ys, xs
        links = [((a[1], a[0]), (b[1], b[0])) for a, b in links]
    opened = _choose_open(rng, links, xs, ys)
    return _assemble(rng, links, opened, xs, ys)


def _line_counts(rng: np.random.Generator, size: str) -> tuple[int, int]:
    """Vertical and horizontal hallway lines."""
    options = {
        "small": [(1, 1), (2, 1), (1, 0), (2, 2)],
        "medium": [(2, 1), (2, 2), (3, 1), (1, 1)],
        "large": [(2, 2), (3, 2), (2, 3), (3, 1)],
    }[size]
    return options[int(rng.choice(4, p=[0.35, 0.35, 0.15, 0.15]))]


def _positions(rng: np.random.Generator, extent_m: float, count: int) -> list[int]:
    """Both ends and `count` lines between them, in cells, spaced for rows of rooms."""
    low, high = _ROOM_DEPTH_M, extent_m - _ROOM_DEPTH_M
    if count == 0:
        return [round(low / CELL_M), round(high / CELL_M)]
    gaps = [
        float(
            rng.choice(
                [rng.uniform(6.8, 8.5), rng.uniform(9.0, 13.5), rng.uniform(13.5, 19.0)],
                p=[0.15, 0.6, 0.25],
            )
        )
        for _ in range(count - 1)
    ]
    room = high - low - 6.0
    if sum(gaps) > room:
        gaps = [gap * max(room, 7.0 * (count - 1)) / sum(gaps) for gap in gaps]
    slack = max(high - low - sum(gaps), 6.0)
    first = low + slack * rng.uniform(0.2, 0.8)
    lines = [first + sum(gaps[:index]) for index in range(count)]
    ends = [min(low, first - 3.0), max(high, lines[-1] + 3.0)]
    return [round(value / CELL_M) for value in (ends[0], *lines, ends[1])]


def _grow(rng: np.random.Generator, xs: list[int], ys: list[int], target_m: float) -> list[Link]:
    """Links of a connected part of the lattice, about `target_m` long."""
    inner = {(i, j) for i in range(1, len(xs) - 1) for j in range(1, len(ys) - 1)}
    if not inner:
        across = 1 if len(xs) > 2 else 0
        return [((1, 0), (1, 1))] if across else [((0, 1), (1, 1))]
    candidates: list[Link] = []
    for i, j in sorted(inner):
        candidates += [((i - 1, j), (i, j)), ((i, j - 1), (i, j))]
        if i == len(xs) - 2:
            candidates.append(((i, j), (i + 1, j)))
        if j == len(ys) - 2:
            candidates.append(((i, j), (i, j + 1)))
    points = sorted(inner)
    reached = {points[int(rng.integers(len(points)))]}
    chosen: list[Link] = []
    total_m = 0.0
    while total_m < target_m:
        usable = [
            link
            for link in candidates
            if link not in chosen and (link[0] in reached or link[1] in reached)
        ]
        if not usable:
            break
        weights = np.array([_eagerness(link, inner, reached) for link in usable])
        link = usable[int(rng.choice(len(usable), p=weights / weights.sum()))]
        chosen.append(link)
        reached.update(link)
        total_m += _length_m(link, xs, ys)
    return sorted(chosen)


def _eagerness(link: Link, inner: set[Point], reached: set[Point]) -> float:
    """How likely a link is added: loops first, dead ends last."""
    if link[0] in reached and link[1] in reached:
        return 5.0
    return 2.0 if link[0] in inner and link[1] in inner else 0.9


def _length_m(link: Link, xs: list[int], ys: list[int]) -> float:
    (i, j), (k, m) = link
    return (abs(xs[k] - xs[i]) + abs(ys[m] - ys[j])) * CELL_M


def _choose_open(
    rng: np.random.Generator, links: list[Link], xs: list[int], ys: list[int]
) -> set[Link]:
    """Links that become open spaces or lounges; some hallway always remains."""
    degree: dict[Point, int] = {}
    for link in links:
        for point in link:
            degree[point] = degree.get(point, 0) + 1
    opened: set[Link] = set()
    for index in rng.permutation(len(links)):
        link = links[int(index)]
        length_m = _length_m(link, xs, ys)
        is_stub = min(degree[point] for point in link) == 1
        beside = any(set(link) & set(other) for other in opened)
        chance = 0.2 if is_stub else 0.45
        fits = len(links) > 2 and len(opened) < 2 and not beside and 6.0 < length_m < 12.0
        if fits and rng.random() < chance:
            opened.add(link)
    return opened


def _assemble(
    rng: np.random.Generator, links: list[Link], opened: set[Link], xs: list[int], ys: list[int]
) -> Skeleton:
    """Runs and junctions from links."""
    points = sorted({point for link in links for point in link})
    number = {point: index for index, point in enumerate(points)}
    junctions = [(xs[i], ys[j]) for i, j in points]
    base_m = rng.choice(
        [rng.uniform(1.15, 1.5), rng.uniform(1.6, 2.0), rng.uniform(2.0, 2.5)],
        p=[0.28, 0.56, 0.16],
    )
    runs: list[Run] = []
    for horizontal in (True, False):
        chains: list[list[Link]] = []
        ordered = sorted(
            (link for link in links if (link[0][1] == link[1][1]) == horizontal),
            key=lambda link: (link[0][1], link[0][0]) if horizontal else link[0],
        )
        for link in ordered:
            last = chains[-1][-1] if chains else None
            if last and last[1] == link[0] and last not in opened and link not in opened:
                chains[-1].append(link)
            else:
                chains.append([link])
        for chain in chains:
            runs.append(_run(rng, chain, chain[0] in opened, horizontal, base_m, number, xs, ys))
    arms: dict[int, list[tuple[int, int]]] = {index: [] for index in range(len(points))}
    for index, run in enumerate(runs):
        for here, after in zip(run.stops, run.stops[1:], strict=False):
            arms[here.junction].append((index, 1))
            arms[after.junction].append((index, -1))
    skeleton = Skeleton(runs, junctions, 0, 0, arms)
    _finish(
        rng, skeleton, [_junction_reach_m(rng, skeleton, index) for index in range(len(points))]
    )
    return skeleton


def _run(
    rng: np.random.Generator,
    chain: list[Link],
    is_open: bool,
    horizontal: bool,
    base_m: float,
    number: dict[Point, int],
    xs: list[int],
    ys: list[int],
) -> Run:
    """One run along a chain of links."""
    chain_points = [chain[0][0], *(link[1] for link in chain)]
    along = [xs[i] if horizontal else ys[j] for i, j in chain_points]
    across = ys[chain_points[0][1]] if horizontal else xs[chain_points[0][0]]
    width_m = (
        float(rng.uniform(3.4, 6.6))
        if is_open
        else float(np.clip(base_m + rng.normal(0.0, 0.12), 1.15, 2.7))
    )
    return Run(
        horizontal,
        across,
        round(width_m / CELL_M / 2),
        is_open,
        [
            Stop(position, number[point])
            for position, point in zip(along, chain_points, strict=True)
        ],
    )


def _finish(rng: np.random.Generator, skeleton: Skeleton, junction_reach_m: list[float]) -> None:
    """How far the floors go at their ends, and where turns begin along each run."""
    for run in skeleton.runs:
        ends = []
        for stop in run.stops:
            halls, opens = _crossing_halves(skeleton, stop.junction, run.horizontal)
            before, after = (
                max(
                    junction_reach_m[stop.junction] * float(rng.uniform(0.92, 1.08)),
                    max(halls, default=0) * CELL_M + 0.1,
                )
                for _ in range(2)
            )
            stop.reach_m = (before, after)
            ends.append(0 if run.is_open else max(halls + [half - 6 for half in opens], default=0))
        run.extend = (ends[0], ends[-1])


def _crossing_halves(
    skeleton: Skeleton, junction: int, horizontal: bool
) -> tuple[list[int], list[int]]:
    """Half widths of the hallways and of the open spaces that cross a run at a junction."""
    crossing = [
        skeleton.runs[other]
        for other, _ in skeleton.arms[junction]
        if skeleton.runs[other].horizontal != horizontal
    ]
    return (
        [other.half for other in crossing if not other.is_open],
        [other.half for other in crossing if other.is_open],
    )


def _junction_reach_m(rng: np.random.Generator, skeleton: Skeleton, junction: int) -> float:
    """Distance from a junction's centre to the nodes on its arms.

    All arms have about the same, so that turns cut the corner at about 45 degrees, as the
    authors drew them; then no arm is mistaken for one that the robot drives past.
    """
    across = [_crossing_halves(skeleton, junction, horizontal) for horizontal in (True, False)]
    halls = [half * CELL_M for some, _ in across for half in some]
    opens = [half * CELL_M for _, some in across for half in some]
    if len(skeleton.arms[junction]) == 1 or not all(some or other for some, other in across):
        return float(rng.uniform(1.3, 2.0))  # a dead end, or a hallway that becomes open space
    reach_m = max(halls, default=0.8) + float(rng.uniform(0.0, 0.5))
    if opens:
        return max(reach_m, min(max(opens) * float(rng.uniform(0.6, 0.9)), 2.3))
    return reach_m

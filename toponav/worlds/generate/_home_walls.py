"""The faces of a home's walls, where their windows are and what hangs on them."""

import itertools
from dataclasses import dataclass, field

import numpy as np

from toponav.core.vocabulary import RoomKind
from toponav.worlds.generate._home_shell import CELL_M, Shell

__all__ = ["WallRun", "Window", "place_windows", "wall_runs"]

_TOUCH_M = 0.002
"""Things may touch."""

_BEYOND = 5
"""An outer wall is this many cells thick."""


@dataclass(frozen=True)
class Window:
    """A window, by its bounds along a wall and its heights."""

    start_m: float
    stop_m: float
    sill_m: float
    head_m: float


@dataclass(eq=False)
class WallRun:
    """A straight face of wall that looks into one room.

    Attributes:
        room: Number of the room.
        horizontal: Whether it runs along x.
        line_m: y (or x) of the face.
        start_m: Where it begins along x (or y).
        stop_m: Where it ends.
        normal: +1 where the room lies at larger y (or x), else -1.
        outer: Stretches of it behind which there is no room.
        windows: Windows in it.
        used: Places on it that are taken: start, stop, low and high.
    """

    room: int
    horizontal: bool
    line_m: float
    start_m: float
    stop_m: float
    normal: int
    outer: list[tuple[float, float]]
    windows: list[Window] = field(default_factory=list)
    used: list[tuple[float, float, float, float]] = field(default_factory=list)

    @property
    def length_m(self) -> float:
        """How long it is."""
        return self.stop_m - self.start_m

    @property
    def yaw_rad(self) -> float:
        """Turn of a thing whose back is at this wall."""
        if self.horizontal:
            return 0.0 if self.normal > 0 else np.pi
        return -np.pi / 2 if self.normal > 0 else np.pi / 2

    def point(self, along_m: float, depth_m: float) -> tuple[float, float]:
        """The (x, y) this far along the wall and in front of it."""
        across = self.line_m + self.normal * depth_m
        return (along_m, across) if self.horizontal else (across, along_m)

    def is_clear(self, span: tuple[float, float], heights: tuple[float, float]) -> bool:
        """Whether no window and nothing that hangs or stands there is in the way."""
        taken = [(w.start_m, w.stop_m, w.sill_m, w.head_m) for w in self.windows] + self.used
        return not any(
            span[0] < stop - _TOUCH_M
            and start < span[1] - _TOUCH_M
            and heights[0] < high
            and low < heights[1]
            for start, stop, low, high in taken
        )


def wall_runs(shell: Shell) -> list[WallRun]:
    """Every face of wall, jambs of openings included, in a fixed order."""
    outside = ~shell.wall & (shell.room_index < 0)
    runs = []
    for horizontal in (True, False):
        index = shell.room_index if horizontal else shell.room_index.T
        wall = shell.wall if horizontal else shell.wall.T
        beyond = outside if horizontal else outside.T
        for normal in (1, -1):
            behind = np.roll(wall, normal, axis=0)
            far = np.roll(beyond, normal * _BEYOND, axis=0)
            faces = np.where(behind & (index >= 0), index, -1)
            for line in np.flatnonzero((faces >= 0).any(axis=1)):
                row = faces[line]
                edges = np.flatnonzero(np.diff(row, prepend=-1, append=-1))
                for start, stop in itertools.pairwise(edges):
                    if row[start] < 0:
                        continue
                    at = int(line) + (0 if normal > 0 else 1)
                    runs.append(
                        WallRun(
                            int(row[start]),
                            horizontal,
                            at * CELL_M,
                            int(start) * CELL_M,
                            int(stop) * CELL_M,
                            normal,
                            _stretches(far[line, start:stop], int(start)),
                        )
                    )
    return runs


def _stretches(flags: np.ndarray, first: int) -> list[tuple[float, float]]:
    """Bounds in metres of each run of true cells."""
    edges = np.flatnonzero(np.diff(flags.astype(np.int8), prepend=0, append=0))
    return [
        ((first + int(low)) * CELL_M, (first + int(high)) * CELL_M)
        for low, high in zip(edges[::2], edges[1::2], strict=True)
    ]


_SILL_M: dict[RoomKind, tuple[float, float]] = {
    RoomKind.LIVING_ROOM: (0.15, 0.9),
    RoomKind.DINING_ROOM: (0.4, 0.9),
    RoomKind.BEDROOM: (0.8, 0.95),
    RoomKind.STUDY: (0.8, 0.95),
    RoomKind.KITCHEN: (1.05, 1.15),
    RoomKind.BATHROOM: (1.35, 1.5),
    RoomKind.HALLWAY: (0.9, 1.1),
}
_SHARE = {RoomKind.BATHROOM: 0.5, RoomKind.HALLWAY: 0.4, RoomKind.STORAGE: 0.0}


def place_windows(rng: np.random.Generator, shell: Shell, runs: list[WallRun]) -> None:
    """Cuts windows into outer walls, wider where people live and small in bathrooms."""
    head_m = min(shell.ceiling_m - 0.2, float(rng.choice([2.1, 2.15, 2.25])))
    sills = {kind: round(float(rng.uniform(*span)), 2) for kind, span in _SILL_M.items()}
    for run in runs:
        kind = shell.specs[run.room].kind
        if rng.random() > _SHARE.get(kind, 0.9):
            continue
        for low, high in run.outer:
            _fill_stretch(rng, run, kind, (low + 0.25, high - 0.25), (sills[kind], head_m))


def _fill_stretch(
    rng: np.random.Generator,
    run: WallRun,
    kind: RoomKind,
    span: tuple[float, float],
    heights: tuple[float, float],
) -> None:
    """One window for each three metres or so of a stretch."""
    small = kind in (RoomKind.BATHROOM, RoomKind.HALLWAY)
    length = span[1] - span[0]
    if length < (0.5 if small else 0.8):
        return
    count = 1 if small else max(1, round(length / 3.2))
    part = length / count
    for number in range(count):
        most = min(part - 0.3 if count > 1 else part, 0.8 if small else 2.0)
        width = round(float(rng.uniform(0.6 * most, most)), 2)
        # Rounded up, a window can be a hair wider than its part of the wall.
        start = span[0] + number * part + float(rng.uniform(0, max(0.0, part - width)))
        window = Window(round(start, 2), round(start + width, 2), *heights)
        if width >= 0.45 and run.is_clear((window.start_m, window.stop_m), heights):
            run.windows.append(window)

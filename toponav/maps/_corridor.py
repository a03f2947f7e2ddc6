"""One corridor: a course from place to place, and where things are along it."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

__all__ = ["Corridor"]

_LOOK_M = 1.5


@dataclass(frozen=True)
class Corridor:
    """A way from one junction, bend or dead end to another."""

    start: int
    """Point at which it begins."""
    end: int
    """Point at which it ends."""
    line_m: Float[np.ndarray, "points 2"]
    """Its course, nearly straight."""

    @property
    def length_m(self) -> float:
        """Length of its course."""
        return float(self._steps_m.sum())

    @property
    def _steps_m(self) -> Float[np.ndarray, " steps"]:
        steps = np.diff(self.line_m, axis=0)
        return np.asarray(np.hypot(steps[:, 0], steps[:, 1]))

    def at(self, along_m: float) -> tuple[float, float, float]:
        """Position and heading at a distance from the start; goes on straight beyond the ends."""
        steps = self._steps_m
        number = int(np.searchsorted(np.cumsum(steps), along_m))
        number = min(max(number, 0), len(steps) - 1)
        rest = along_m - float(steps[:number].sum())
        before, after = self.line_m[number], self.line_m[number + 1]
        unit = (after - before) / max(float(steps[number]), 1e-9)
        x_m, y_m = before + rest * unit
        return float(x_m), float(y_m), math.atan2(float(unit[1]), float(unit[0]))

    def leaving_rad(self, end: int) -> float:
        """Heading with which it leaves one of its ends (0 start, 1 end), seen from afar."""
        look_m = min(_LOOK_M, self.length_m)
        near = self.line_m[0] if end == 0 else self.line_m[-1]
        far = self.at(look_m if end == 0 else self.length_m - look_m)
        return math.atan2(far[1] - float(near[1]), far[0] - float(near[0]))

    def nearest(self, x_m: float, y_m: float) -> tuple[float, float]:
        """How far along and how far aside the nearest point of the course is."""
        start, step = self.line_m[:-1], np.diff(self.line_m, axis=0)
        length = np.maximum(self._steps_m, 1e-9)
        offset = np.array([x_m, y_m]) - start
        share = np.clip((offset * step).sum(axis=1) / length**2, 0.0, 1.0)
        away = offset - share[:, None] * step
        aside = np.hypot(away[:, 0], away[:, 1])
        best = int(aside.argmin())
        return float(length[:best].sum() + share[best] * length[best]), float(aside[best])

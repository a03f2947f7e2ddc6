"""Faults of a depth camera, on purpose: lost, late, NaN and frozen frames. Without ROS."""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float32

from toponav.core.errors import InputError

__all__ = ["FaultInjector", "FaultSpec", "parse_faults"]

_KINDS: Final = ("drop", "delay", "nan", "frozen")


@dataclass(frozen=True)
class FaultSpec:
    """What goes wrong, from when to when."""

    drop_share: float = 0.0
    """Share of frames that are lost."""
    delay_s: float = 0.0
    """How late every frame is."""
    nan_share: float = 0.0
    """Share of the time in which frames are all NaN."""
    frozen_share: float = 0.0
    """Share of the time in which the first frame of the spell repeats."""
    period_s: float = 10.0
    """Spells of NaN and of frozen frames begin so often."""
    begins_s: float = 5.0
    """When the first spell begins."""


def parse_faults(texts: tuple[str, ...]) -> FaultSpec:
    """What `drop:0.2`, `delay:0.3`, `nan:0.2` and `frozen:0.2` say together.

    Raises:
        InputError: A text is none of them.
    """
    found: dict[str, float] = {}
    for text in texts:
        kind, _, value = text.partition(":")
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if kind not in _KINDS or not 0 <= number <= (10 if kind == "delay" else 1):
            raise InputError(
                f"'{text}' is no fault",
                where="--fault",
                remedy="give drop:SHARE, delay:SECONDS, nan:SHARE or frozen:SHARE",
            )
        found["delay_s" if kind == "delay" else f"{kind}_share"] = number
    return FaultSpec(**found)


class FaultInjector:
    """Passes frames on as a faulty camera would; repeatable given its seed.

    Args:
        spec: What goes wrong.
        seed: Seed of which frames are lost.
    """

    def __init__(self, spec: FaultSpec, seed: int = 0) -> None:
        self._spec = spec
        self._random = np.random.default_rng(seed)
        self._late: deque[tuple[float, Float32[np.ndarray, "height width"]]] = deque()
        self._frozen: Float32[np.ndarray, "height width"] | None = None

    def put(self, depth_m: Float32[np.ndarray, "height width"], time_s: float) -> None:
        """The camera took this frame."""
        spec = self._spec
        in_spell_s = (time_s - spec.begins_s) % spec.period_s
        if in_spell_s < spec.frozen_share * spec.period_s:
            if self._frozen is None:
                self._frozen = depth_m.copy()
            depth_m = self._frozen
        else:
            self._frozen = None
        if in_spell_s < spec.nan_share * spec.period_s:
            depth_m = np.full_like(depth_m, np.nan)
        if spec.drop_share and self._random.random() < spec.drop_share:
            return
        self._late.append((time_s, depth_m))

    def clear(self) -> None:
        """Forget frames that have not come out yet."""
        self._late.clear()
        self._frozen = None

    def is_due(self, now_s: float) -> bool:
        """Whether a frame comes out now."""
        return bool(self._late) and self._late[0][0] + self._spec.delay_s <= now_s + 1e-9

    def due(self, now_s: float) -> list[tuple[float, Float32[np.ndarray, "height width"]]]:
        """The frames that come out now, with the time at which each was taken."""
        out = []
        while self.is_due(now_s):
            out.append(self._late.popleft())
        return out

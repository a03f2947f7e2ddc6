"""The relative pose of two panoramas from ranges and colours all around (F_R, made precise).

The network says that two panoramas belong together and roughly where; laying what one sees over
what the other sees says to centimetres where, and is a second opinion on whether at all.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float32, Int64, UInt8

from toponav.core.geometry import Pose2, wrap_angle
from toponav.models.nts.panorama import MAX_RANGE_M, column_yaw_rad, horizontal_scale
from toponav.navigation.nts.registration_kernels import alike, refine, search

__all__ = ["Registration", "Signature", "align", "register", "signature"]

_FINE, _COARSE = 144, 72
_COLOR_SPREAD = 22.0
_FAR_M = 8.0
_PITCH_M = 0.3
_CANDIDATES = 4


@dataclass(frozen=True, eq=False)
class Signature:
    """What a panorama shows at the camera's height, where perspective changes nothing.

    Attributes:
        range_m: Distance per direction, from forward to the left.
        color: Colour per direction.
    """

    range_m: Float32[np.ndarray, " directions"]
    color: Float32[np.ndarray, "directions 3"]

    def coarse(self) -> "Signature":
        """Half as many directions."""
        return Signature(
            np.ascontiguousarray(self.range_m[::2]), np.ascontiguousarray(self.color[::2])
        )


@dataclass(frozen=True)
class Registration:
    """Where the goal's panorama was taken.

    Attributes:
        pose: In the frame of the source.
        score: Share of what both should see that agrees, 0..1.
    """

    pose: Pose2
    score: float


@lru_cache(maxsize=4)
def _columns(width: int, directions: int) -> Int64[np.ndarray, " directions"]:
    """The column that looks in each direction."""
    yaw = column_yaw_rad(width)
    wanted = np.arange(directions) * (2 * math.pi / directions)
    off = np.abs((wanted[:, None] - yaw[None, :] + math.pi) % (2 * math.pi) - math.pi)
    return np.asarray(off.argmin(axis=1))


def signature(
    rgb: UInt8[np.ndarray, "height width 3"],
    depth_m: Float32[np.ndarray, "height width"] | None,
    sight_m: Float32[np.ndarray, " ranges"] | None = None,
) -> Signature:
    """The signature of a panorama.

    Args:
        rgb: The panorama.
        depth_m: Its depth.
        sight_m: Predicted ranges of level sight, where there is no depth.
    """
    height, width = rgb.shape[:2]
    columns = _columns(width, _FINE)
    band = rgb[height // 2 - 3 : height // 2 + 3].astype(np.float32).mean(axis=0)
    near = (columns[:, None] + np.arange(-1, 2)) % width
    color = band[near].mean(axis=1)
    if depth_m is not None:
        level = np.median(depth_m[height // 2 - 2 : height // 2 + 2], axis=0)
        range_m = level[columns] * horizontal_scale(width)[columns]
        range_m = np.where(level[columns] > 0, range_m, MAX_RANGE_M)
    else:
        assert sight_m is not None
        at = np.arange(_FINE) * (len(sight_m) / _FINE)
        around = np.append(sight_m, sight_m[0])
        range_m = np.interp(at, np.arange(len(around)), around)
    return Signature(range_m.astype(np.float32), color.astype(np.float32))


def register(
    source: Signature,
    goal: Signature,
    reach_m: float,
    hint: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Registration:
    """The pose, among those that the source sees over, from which the goal fits it best.

    Args:
        source: What is seen now.
        goal: What is looked for.
        reach_m: How far from the source.
        hint: Where it should be by another opinion, and how much agreement that opinion is
            worth: places a metre away from it have to agree so much better.
    """
    small, wanted = source.coarse(), goal.coarse()
    best = np.zeros((_CANDIDATES, 4))
    colour = alike(small.color, wanted.color, _COLOR_SPREAD)
    search(small.range_m, wanted.range_m, colour, reach_m, _PITCH_M, _FAR_M, np.array(hint), best)
    fine = alike(source.color, goal.color, _COLOR_SPREAD)
    found, best_worth = Registration(Pose2(0.0, 0.0, 0.0), 0.0), 0.0
    for row in best[best[:, 0] > 0]:
        pose = row[1:].copy()
        score = refine(
            source.range_m, goal.range_m, fine, _FAR_M, pose, 0.12, math.radians(5.0), 3
        )
        away_m = math.hypot(pose[0] - hint[0], pose[1] - hint[1])
        worth = score - hint[2] * min(1.0, away_m)
        if worth > best_worth:
            found, best_worth = Registration(_pose(pose), float(score)), worth
    return found


def align(source: Signature, goal: Signature, guess: Pose2) -> Registration:
    """The best pose near a guess."""
    fine = alike(source.color, goal.color, _COLOR_SPREAD)
    pose = np.array(guess)
    score = refine(source.range_m, goal.range_m, fine, _FAR_M, pose, 0.08, math.radians(4.0), 3)
    return Registration(_pose(pose), float(score))


def _pose(values: np.ndarray) -> Pose2:
    return Pose2(float(values[0]), float(values[1]), wrap_angle(float(values[2])))

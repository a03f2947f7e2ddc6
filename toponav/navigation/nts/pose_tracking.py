"""Where the robot is since its start: wheels, put right by what it saw a moment ago."""

import math

from toponav.core.geometry import Pose2
from toponav.core.imagenav import FORWARD_M, TURN_RAD, Action
from toponav.navigation.nts.registration import Signature, align

__all__ = ["PoseTracker", "commanded"]

_FURTHEST_M, _MOST_TURN_RAD = 0.8, math.radians(60.0)
_KEYFRAME_M = 1.0
_LEAST_SCORE, _KEYFRAME_SCORE = 0.5, 0.62
_MOST_OFF_M, _MOST_OFF_RAD = 0.3, math.radians(12.0)


def commanded(action: Action | None) -> Pose2:
    """What an action is meant to do, in the robot's frame."""
    forward_m = FORWARD_M if action is Action.FORWARD else 0.0
    turn = {Action.LEFT: TURN_RAD, Action.RIGHT: -TURN_RAD}.get(action or Action.STOP, 0.0)
    return Pose2(forward_m, 0.0, turn)


class PoseTracker:
    """The pose in the frame of the start.

    Odometry's steps are added up; where there is a depth camera, each view is laid over the last
    keyframe, which takes back most of the error. A step that no robot can make is replaced by
    what was commanded.

    Args:
        aligned: Whether views are laid over keyframes.
    """

    def __init__(self, *, aligned: bool) -> None:
        self.pose = Pose2(0.0, 0.0, 0.0)
        self._aligned = aligned
        self._odometry: Pose2 | None = None
        self._keyframe: tuple[Pose2, Signature] | None = None

    def update(self, odometry: Pose2, view: Signature | None, last_action: Action | None) -> Pose2:
        """The pose after a step."""
        if not all(map(math.isfinite, odometry)):
            odometry = (self._odometry or Pose2(0.0, 0.0, 0.0)).compose(commanded(last_action))
        if self._odometry is None:
            self._odometry = odometry
            self.pose = odometry
        step = odometry.relative_to(self._odometry)
        if math.hypot(step.x_m, step.y_m) > _FURTHEST_M or abs(step.yaw_rad) > _MOST_TURN_RAD:
            step = commanded(last_action)
        self._odometry = odometry
        self.pose = self.pose.compose(step)
        if self._aligned and view is not None:
            self._align(view)
        return self.pose

    def _align(self, view: Signature) -> None:
        if self._keyframe is None:
            self._keyframe = (self.pose, view)
            return
        origin, seen = self._keyframe
        guess = self.pose.relative_to(origin)
        found = align(seen, view, guess)
        off = found.pose.relative_to(guess)
        is_near = math.hypot(off.x_m, off.y_m) < _MOST_OFF_M and abs(off.yaw_rad) < _MOST_OFF_RAD
        if found.score > _LEAST_SCORE and is_near:
            self.pose = origin.compose(found.pose)
        away_m = self.pose.distance_to(origin)
        if away_m > _KEYFRAME_M or found.score < _KEYFRAME_SCORE:
            self._keyframe = (self.pose, view)

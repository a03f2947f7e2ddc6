"""The ceiling: an agent that knows the floor plan, its pose and the goal, under the same noise."""

import math

import numpy as np

from toponav.core.geometry import Pose2, wrap_angle
from toponav.core.imagenav import (
    FORWARD_M,
    TURN_RAD,
    Action,
    ImageGoal,
    ImageNavBelief,
    PanoramaObservation,
)
from toponav.sim.imagenav import ImageNavSimulation

__all__ = ["ShortestPathAgent"]

_COMFORT_M = 0.15
_NEAR_WALL = 3.0
_AHEAD_M = 0.6
_STOP_M = 0.5


class ShortestPathAgent:
    """Follows the shortest path that keeps off the walls, and stops within half a metre.

    It needs no picture; where it fails, the motions' errors or the building are to blame.
    """

    def __init__(self) -> None:
        self._simulation: ImageNavSimulation | None = None
        self._field: np.ndarray | None = None
        self._blocked = 0
        self._turn = Action.LEFT
        self._belief = ImageNavBelief()

    def attach_truth(self, simulation: ImageNavSimulation) -> None:
        """Takes the building and the true pose from the simulation."""
        self._simulation = simulation

    def reset(self, goal: ImageGoal, keep_map: bool = False) -> None:
        """Plans from everywhere to the goal."""
        simulation = self._truth
        space = simulation.free_space
        slack = (space.clearance_m - simulation.radius_m) / _COMFORT_M
        weight = 1.0 + _NEAR_WALL * np.clip(1.0 - slack, 0.0, 1.0)
        there = (simulation.goal.x_m, simulation.goal.y_m)
        self._field = space.geodesic_m(there, weight.astype(np.float32))
        self._blocked = 0

    def act(self, observation: PanoramaObservation) -> Action:
        """The action that follows the path."""
        simulation = self._truth
        pose = simulation.state.pose
        if simulation.distance_to_goal_m() <= _STOP_M:
            self._belief = ImageNavBelief(mode="stop", stopped_because="at the goal")
            return Action.STOP
        target = self._target(pose)
        bearing = wrap_angle(math.atan2(target[1] - pose.y_m, target[0] - pose.x_m) - pose.yaw_rad)
        self._belief = ImageNavBelief(mode="follow")
        if self._blocked:
            # What touched while driving ahead is passed by turning a little and trying again.
            self._blocked -= 1
            return Action.FORWARD if self._blocked == 0 else self._turn
        if observation.collided:
            self._blocked = 4
            self._turn = self._freer_side(pose)
            return self._turn
        if abs(bearing) > 0.6 * TURN_RAD:
            return Action.LEFT if bearing > 0 else Action.RIGHT
        return Action.FORWARD

    def belief(self) -> ImageNavBelief:
        """Only what it is doing."""
        return self._belief

    @property
    def _truth(self) -> ImageNavSimulation:
        assert self._simulation is not None, "the runner attaches the truth before each episode"
        return self._simulation

    def _target(self, pose: Pose2) -> np.ndarray:
        """The farthest point of the path ahead that is near and in line of sight."""
        assert self._field is not None
        space = self._truth.free_space
        if not np.isfinite(self._field[space.nearest_free(pose.x_m, pose.y_m)]):
            # Another driver left it where the floor plan sees no way out: back to where there is.
            cells = np.argwhere(np.isfinite(self._field))
            centers = (cells[:, ::-1] + 0.5) * space.grid.resolution_m + space.grid.origin_m
            away: np.ndarray = centers[np.hypot(*(centers - pose[:2]).T).argmin()]
            return away
        path = space.path_m(self._field, (pose.x_m, pose.y_m))
        near = np.hypot(*(path - np.array(pose[:2])).T) < _AHEAD_M
        last = len(near) if near.all() else int(near.argmin())
        target: np.ndarray = path[max(min(last, len(path) - 1), 0)]
        return target

    def _freer_side(self, pose: Pose2) -> Action:
        space = self._truth.free_space
        clear_m = []
        for side in (1, -1):
            yaw_rad = pose.yaw_rad + side * 3 * TURN_RAD
            x_m = pose.x_m + FORWARD_M * math.cos(yaw_rad)
            y_m = pose.y_m + FORWARD_M * math.sin(yaw_rad)
            row, col = space.grid.cell_of(x_m, y_m)
            inside = 0 <= row < space.grid.rows and 0 <= col < space.grid.cols
            clear_m.append(float(space.clearance_m[row, col]) if inside else 0.0)
        return Action.LEFT if clear_m[0] >= clear_m[1] else Action.RIGHT

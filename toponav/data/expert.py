"""A driver with the floor plan and the true pose: the teacher, and the ceiling of the protocol."""

import math

import numpy as np

from toponav.core.episode import Velocity, VelocityLimits
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.data.global_planner import CostToGo, GlobalPlanner, PlannerCosts
from toponav.data.local_planner import PathFollower
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap
from toponav.worlds.scene import Scene

__all__ = ["Expert"]


class Expert:
    """Drives a plan as the ROS navigation stack with the truth would, at 5 Hz.

    The global planner finds the cost to go from everywhere near the plan (`GlobalPlanner`); the
    local planner follows a smooth path down it (`PathFollower`). `act` may be asked about any
    pose, also one that the expert would not have reached: off its path it plans a new one, so
    it also labels what a learner drove into. The same calls give the same commands.

    Args:
        scene: The building.
        topological_map: The map whose plans are driven.
        limits: What the robot can do.
        costs: What the global planner avoids.

    Example:
        >>> expert = Expert(scene, topological_map)
        >>> expert.reset(shortest_plan(topological_map, "office_1", "WC_1"), start)
        >>> command = expert.act(pose, velocity)
    """

    def __init__(
        self,
        scene: Scene,
        topological_map: TopologicalMap,
        limits: VelocityLimits | None = None,
        costs: PlannerCosts | None = None,
    ) -> None:
        self.planner = GlobalPlanner(scene, topological_map, costs)
        self.follower = PathFollower(
            self.planner.clearance_m, self.planner.resolution_m, limits or VelocityLimits()
        )
        self._origin = (float(scene.grid.origin_m[0]), float(scene.grid.origin_m[1]))
        self._field: CostToGo | None = None
        self._plan: Plan | None = None

    def reset(self, plan: Plan, pose: Pose2) -> None:
        """Plan the way of `plan` from `pose`.

        Raises:
            InputError: When no way leads to the goal.
        """
        self._plan = plan
        self._field = None
        self._replan(pose)

    @property
    def path_m(self) -> np.ndarray:
        """The path that it follows, [points, 2] in the map's frame."""
        return np.asarray(self.follower.points + np.array(self._origin))

    def act(self, pose: Pose2, velocity: Velocity) -> Velocity:
        """The command at this pose and measured velocity."""
        assert self._plan is not None, "reset comes first"
        local = Pose2(pose.x_m - self._origin[0], pose.y_m - self._origin[1], pose.yaw_rad)
        if self.follower.is_lost(local):
            self._replan(pose)
        return self.follower.follow(local, velocity)

    def _replan(self, pose: Pose2) -> None:
        assert self._plan is not None
        for reach_m in (2.0, 6.0, math.inf):
            if self._field is not None and self._field.reach_m > reach_m:
                continue
            if self._field is None or self._field.reach_m < reach_m:
                self._field = self.planner.cost_to_go(self._plan, min(reach_m, 1e3))
            path = self.planner.path(self._field, pose)
            if path is not None:
                self.follower.set_path(path)
                return
        raise InputError(
            f"no way for the robot from ({pose.x_m:.2f}, {pose.y_m:.2f}) m to the goal",
            where=f"plan {self._plan.nodes[0]} -> {self._plan.nodes[-1]}",
            remedy="start on free floor that is connected with the goal",
        )

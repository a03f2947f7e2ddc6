"""A driver with the floor plan and the true pose: the teacher, and the ceiling of the protocol."""

import numpy as np
from jaxtyping import Float

from toponav.core.episode import Velocity, VelocityLimits
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.data.global_planner import CostToGo, GlobalPlanner, PlannerCosts
from toponav.data.local_planner import PathFollower
from toponav.data.tracking_kernels import PathArrays
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap
from toponav.sim.oracle import TruthLocalizer
from toponav.worlds.scene import Scene

__all__ = ["Expert"]

_REACHES_M = (2.0, 6.0, 1000.0)
_REHEARSALS = 7


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
        >>> expert.reset(shortest_plan(topological_map, "office_1", "office_2"), pose)
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
        self._truth = TruthLocalizer(topological_map, scene)
        self._origin = np.array(scene.grid.origin_m, dtype=float)
        self._field: CostToGo | None = None
        self._plan: Plan | None = None

    def reset(self, plan: Plan, pose: Pose2) -> None:
        """Plan the way of `plan` from `pose`, and rehearse it.

        Where the rehearsal strays off the plan, the way there is made dearer and planned again;
        the way that strays least is taken.

        Raises:
            InputError: When no way leads to the goal.
        """
        self._plan, self._field = plan, None
        best: tuple[int, PathArrays, CostToGo] | None = None
        for _ in range(_REHEARSALS):
            field = self._plan_path(pose)
            if field is None:
                raise InputError(
                    f"no way for the robot from ({pose.x_m:.2f}, {pose.y_m:.2f}) m to the goal",
                    where=f"plan {plan.nodes[0]} -> {plan.nodes[-1]}",
                    remedy="start on free floor that is connected with the goal",
                )
            strayed = self._strayed(plan, pose)
            if best is None or len(strayed) < best[0]:
                best = len(strayed), self.follower.path, field
            if len(strayed) == 0:
                break
            self._field = self.planner.avoiding(field, strayed, 1.0)
        assert best is not None
        _, self.follower.path, self._field = best

    @property
    def path_m(self) -> Float[np.ndarray, "points 2"]:
        """The path that it follows, in the map's frame."""
        points: np.ndarray = self.follower.points_m + self._origin
        return points

    def act(self, pose: Pose2, velocity: Velocity) -> Velocity:
        """The command at this pose and measured velocity.

        Where no way leads on from the pose, such as outdoors, it heads for the path it has.
        """
        assert self._plan is not None, "reset comes first"
        local = self._local(pose)
        if self.follower.is_lost(local):
            self._plan_path(pose)
        return self.follower.follow(local, velocity)

    def _local(self, pose: Pose2) -> Pose2:
        """The pose relative to the corner of the scene's grid."""
        x_m, y_m = self._origin
        return Pose2(pose.x_m - x_m, pose.y_m - y_m, pose.yaw_rad)

    def _plan_path(self, pose: Pose2) -> CostToGo | None:
        """Follow a path from the pose, looking farther from the plan until there is one.

        Returns:
            The cost to go that it descends, or None where there is no way at all.
        """
        assert self._plan is not None
        for reach_m in _REACHES_M:
            if self._field is not None and self._field.reach_m > reach_m:
                continue
            if self._field is None or self._field.reach_m < reach_m:
                self._field = self.planner.cost_to_go(self._plan, reach_m)
            found = self.planner.path(self._field, pose)
            if found is not None:
                self.follower.set_path(*found)
                return self._field
        return None

    def _strayed(self, plan: Plan, pose: Pose2) -> Float[np.ndarray, "poses 3"]:
        """Where a rehearsal of the path is off the plan; relative to the grid's corner."""
        poses = self.follower.rehearse(self._local(pose))
        x_m, y_m = poses[:, 0] + self._origin[0], poses[:, 1] + self._origin[1]
        nodes = self._truth.nodes_at(x_m, y_m, poses[:, 2])
        index = self.planner.map.node_index
        arrived = np.flatnonzero(nodes == index[plan.nodes[-1]])
        end = int(arrived[0]) if len(arrived) else len(nodes)
        on_plan = np.ones(len(index) + 1, dtype=bool)  # the last: no node is no deviation
        on_plan[:-1] = [node.id in plan for node in self.planner.map.nodes]
        off_plan: np.ndarray = poses[:end][~on_plan[nodes[:end]]]
        return off_plan

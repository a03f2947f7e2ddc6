"""GraphNav with a belief over poses: what preset `best` drives with."""

import math
from collections.abc import Collection
from dataclasses import replace
from typing import Final

import numpy as np
import torch
from jaxtyping import Float32, Float64

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Belief, Observation, Velocity
from toponav.maps.task import NavigationTask
from toponav.models.checkpoints import load_metric_weights
from toponav.models.graphnav.metric.local_map import LocalMap
from toponav.models.graphnav.metric.map_picture import MAP_CHANNELS, MapArrays
from toponav.models.graphnav.metric.pose_filter import PoseFilter
from toponav.models.graphnav.metric.pose_network import PoseNetwork
from toponav.models.graphnav.metric.steering import SteeringNetwork, steering_features
from toponav.models.graphnav.preprocess import frame_reducer
from toponav.navigation.graphnav.avoidance import CollisionAvoidance
from toponav.navigation.graphnav.depth_guard import DepthGuard
from toponav.navigation.graphnav.detour import Detour
from toponav.navigation.graphnav.hypotheses import AT_DOOR_M, PoseHypotheses
from toponav.navigation.graphnav.metric_config import MetricAgentConfig
from toponav.navigation.graphnav.node_belief import NodeBelief, doorsteps_m, first_door
from toponav.navigation.graphnav.plan_keeping import PlanKeeping
from toponav.navigation.graphnav.room_search import RoomSearch

__all__ = ["MetricGraphNavAgent", "load_metric_agent"]

_STOP: Final = Velocity(0.0, 0.0)
_DETOUR_M = 1.5
_BACK_M, _AHEAD_M, _NEAR_M = 1.0, 2.5, 1.0
_SURE_STD: Final = np.array([0.06, 0.05, 0.03])


class MetricGraphNavAgent:
    """Drives a plan from depth images and the map, knowing how far it has come along an edge.

    The robot adds up its own commands and what it sees in a local map; the pose network lays
    that over the topological map and says how far the believed pose is off; a filter keeps
    the belief. The steering network drives along the plan, told the behaviour that is due.
    Told the true pose at every step, the same agent is GTL.

    Args:
        pose_network: Says how far off a believed pose is.
        steering: Drives.
        camera: The camera that the robot carries.
        config: What surrounds the networks.
    """

    def __init__(
        self,
        pose_network: PoseNetwork,
        steering: SteeringNetwork,
        camera: PinholeCamera,
        config: MetricAgentConfig | None = None,
    ) -> None:
        self.config = parts = config or MetricAgentConfig()
        self._pose_network, self._steering = pose_network.eval(), steering.eval()
        self._keeping: PlanKeeping | None = None
        self._detour = None if parts.detours is None else Detour(parts.detours)
        self._search = None if parts.room_search is None else RoomSearch(parts.room_search)
        self._planner = self._detour or Detour()
        sizes = steering.config
        self._reduce = frame_reducer(camera, sizes)
        self._guard = DepthGuard(camera)
        self._local_map = LocalMap(sizes.image, sizes.local_map)
        self._avoidance = (
            None if parts.avoidance is None else CollisionAvoidance(sizes.image, parts.avoidance)
        )
        cells = sizes.local_map.view_cells
        self._picture = np.empty((MAP_CHANNELS, cells, cells), np.float32)
        self._task: NavigationTask | None = None
        self._true_pose: Float64[np.ndarray, " 3"] | None = None
        self._belief = Belief()

    def reseed(self, seed: int) -> None:
        """Nothing here is random."""

    def reset(self, task: NavigationTask) -> None:
        """Begin at the plan's first node: all that the robot is ever told."""
        self._task = task
        self._arrays = MapArrays.of(task.map, task.plan)
        self._nodes = NodeBelief(task)
        between_m = doorsteps_m(task)
        self._door, self._door_m = first_door(self._arrays, task)
        self._is_inside = self._door is not None
        if self.config.plan_keeping is not None:
            self._keeping = PlanKeeping(task, self._arrays, between_m, self.config.plan_keeping)
        self._planner.clear()
        if self._search is not None:
            self._search.clear()
        start = task.map.node(task.plan.nodes[0])
        yaw_rad = task.map.edge(task.plan.edges[0]).yaw_rad
        parts = self.config
        self._filter = PoseFilter(np.array([[start.x_m, start.y_m, yaw_rad]]), parts.pose_filter)
        self._hypotheses: PoseHypotheses | None = None
        if parts.hypotheses is not None and parts.pose_filter is not None:
            self._hypotheses = PoseHypotheses(
                self._arrays, task, self._pose_network, parts.pose_filter, parts.hypotheses
            )
        self._local_map.clear()
        if self._avoidance is not None:
            self._avoidance.clear()
        self._guard.reset()
        self._progress_m = 0.0
        self._commands = np.zeros((2, 2))
        self._is_first = True
        self._true_pose = None
        self._turn_rad_s: torch.Tensor | None = None
        self._belief = Belief(start.id, task.plan.edges[0])

    def tell_pose(self, x_m: float, y_m: float, yaw_rad: float) -> None:
        """Believe this pose at the next `act`: for GTL, which is told the truth."""
        self._true_pose = np.array([x_m, y_m, yaw_rad])

    def overruled(self, command: Velocity) -> None:
        """The robot carried out this command in place of the last one: dead reckoning follows."""
        self._commands[0] = command.linear_m_s, command.angular_rad_s

    def act(self, observation: Observation) -> Velocity:
        """The command for this step; zero when the frame cannot be trusted."""
        assert self._task is not None, "reset the agent first"
        because = self._guard.fault(observation.depth_m, Velocity(*self._commands[0].tolist()))
        step = self._steering.config.odometry.step(*self._commands)
        if not self._is_first:
            self._local_map.advance(step)
            if self._avoidance is not None:
                self._avoidance.advance(step)
            self._planner.advance(step)
            if self._search is not None:
                self._search.advance(step)
            self._filter.predict(step[None])
            if self._hypotheses is not None:
                self._hypotheses.predict(step)
        self._is_first = False
        self._commands = np.stack([np.zeros(2), self._commands[0]])
        if because:
            return self._stop(because)
        profile = self._reduce(observation.depth_m)
        self._local_map.insert(profile)
        if self._avoidance is not None:
            self._avoidance.insert(profile)
        self._locate()
        return self._drive(profile)

    def belief(self) -> Belief:
        """Where it thinks it is."""
        return self._belief

    @property
    def pose(self) -> Float64[np.ndarray, " 3"]:
        """The believed x, y (metres) and yaw (radians) in the map's frame."""
        if self._hypotheses is not None and self._true_pose is None:
            return self._hypotheses.pose.copy()
        believed: np.ndarray = self._filter.pose[0].copy()
        return believed

    @property
    def std_in_robot(self) -> Float64[np.ndarray, " 3"]:
        """Of the belief: metres forward and left, radians."""
        if self._true_pose is not None:
            return _SURE_STD
        if self._hypotheses is not None:
            return self._hypotheses.std_in_robot
        std: np.ndarray = self._filter.std_in_robot[0]
        return std

    def _stop(self, because: str) -> Velocity:
        last = self._belief
        self._belief = Belief(last.node, last.edge, last.behavior, {}, because)
        return _STOP

    @torch.inference_mode()
    def _locate(self) -> None:
        """Lay what was seen over the map, and correct the belief."""
        config = self._pose_network.config.local_map
        if self._hypotheses is not None and self._true_pose is None:
            self._hypotheses.correct(self._local_map.view(config.far_cell_m))
            self._progress_m = self._hypotheses.progress_m
            self._is_inside = self._hypotheses.is_inside
            if self._search is not None:
                self._search.consider(
                    self._hypotheses.restarts,
                    self._hypotheses.judged,
                    is_early=self._hypotheses.is_early,
                )
            return
        if self._true_pose is not None:
            self._filter.pose[0] = self._true_pose
        believed = self._filter.pose[0]
        low_m, high_m = self._progress_m - _BACK_M, self._progress_m + _AHEAD_M
        progress_m = self._arrays.progress_m(believed[0], believed[1], low_m, high_m)
        self._progress_m = self._inside(believed, progress_m)
        if self._true_pose is not None:
            return
        self._arrays.draw(believed, self._progress_m, config.far_cell_m, self._picture)
        view = self._local_map.view(config.far_cell_m)
        mean, log_std = self._pose_network(
            torch.from_numpy(view)[None], torch.from_numpy(self._picture)[None]
        )
        if not (torch.isfinite(mean).all() and torch.isfinite(log_std).all()):
            return
        correct = self._filter.take if self.config.pose_filter is None else self._filter.correct
        correct(mean.numpy(), log_std.exp().numpy())

    @torch.inference_mode()
    def _drive(self, profile: np.ndarray) -> Velocity:
        config = self._steering.config
        believed = self.pose
        at = self._arrays.progress_m(
            believed[0], believed[1], self._progress_m - _NEAR_M, self._progress_m + _NEAR_M
        )
        at = self._inside(believed, at)
        self._arrays.draw(believed, at, config.local_map.near_cell_m, self._picture)
        view = self._local_map.view(config.local_map.near_cell_m)
        outputs = self._steering(
            torch.from_numpy(view)[None],
            torch.from_numpy(self._picture)[None],
            torch.from_numpy(profile)[None],
            torch.from_numpy(self._features(at)),
        )
        velocity = self._steering.head.velocity(outputs, self._turn_rad_s)
        speed, turn = velocity[0].tolist()
        way_on = self._way_on(believed, at)
        if way_on is not None:
            speed, turn = way_on.linear_m_s, way_on.angular_rad_s
        if not (math.isfinite(speed) and math.isfinite(turn)):
            return self._stop("the steering network gave a velocity that is not finite")
        command = config.limits.clip(Velocity(speed, turn))
        if self._keeping is not None and way_on is None:
            last_turn = float(self._commands[1, 1])
            command = self._keeping.checked(command, last_turn, believed, self.std_in_robot, at)
        if self._avoidance is not None:
            drift_m = config.odometry.step(np.zeros(2), self._commands[1])[0]
            clear = self._avoidance.checked(command, float(drift_m), may_turn_away=way_on is None)
            command = config.limits.clip(clear)
        self._turn_rad_s = velocity[:, 1]
        self._commands[0] = command.linear_m_s, command.angular_rad_s
        self._belief = self._nodes.belief(believed, at, self.std_in_robot)
        return command

    def _inside(self, believed: Float64[np.ndarray, " 3"], progress_m: float) -> float:
        """The progress of a robot that has not come by its first room's door yet, else as it is.

        Behind a wall, the plan's corridor may be nearer than its door.
        """
        if not self._is_inside:
            return progress_m
        assert self._door is not None
        if math.hypot(believed[0] - self._door[0], believed[1] - self._door[1]) < AT_DOOR_M:
            self._is_inside = False
            return progress_m
        return min(progress_m, self._door_m)

    def _way_on(self, believed: Float64[np.ndarray, " 3"], at_m: float) -> Velocity | None:
        """What a robot does that is lost or gets nowhere: planned past what it has seen."""
        cells, cell_m = Detour.view_shape()
        obstacles = None if self._avoidance is None else self._avoidance.obstacles
        if self._search is not None and self._search.is_on:
            view = self._local_map.view(cell_m, cells)
            unseen = self._search.target(view, cell_m)
            if unseen is not None:
                return self._planner.velocity(view, unseen, obstacles)
        if self._detour is None or not self._detour.is_on:
            return None
        ahead_m = at_m + _DETOUR_M
        if self._is_inside:
            ahead_m = self._door_m
        points, arc = self._arrays.way()
        x = float(np.interp(ahead_m, arc, points[:, 0])) - believed[0]
        y = float(np.interp(ahead_m, arc, points[:, 1])) - believed[1]
        c, s = math.cos(believed[2]), math.sin(believed[2])
        target = np.array([x * c + y * s, -x * s + y * c])
        view = self._local_map.view(cell_m, cells)
        return self._detour.velocity(view, target, obstacles)

    def _features(self, progress_m: float) -> Float32[np.ndarray, "1 features"]:
        plan = self._arrays.plan_features(self.pose, progress_m)
        std = self.std_in_robot
        return steering_features(
            plan[None], self._commands[1][None], std[None], self._steering.config.limits
        )


def load_metric_agent(
    weights: str | None,
    *,
    pose_filter: bool,
    camera: PinholeCamera,
    without: Collection[str] = (),
) -> MetricGraphNavAgent:
    """GraphNav with a pose belief, with the networks of a folder or of a shipped preset.

    Args:
        weights: A folder of checkpoints, the name of a shipped preset, or None for `best`.
        pose_filter: Whether to filter the belief (GraphNavPF).
        camera: The camera that the robot carries.
        without: Parts to leave out, of `metric_config.PARTS`.

    Raises:
        InputError: The weights cannot be read, or the camera does not suit them.
    """
    loaded = load_metric_weights(weights or "best")
    config = MetricAgentConfig().without(without)
    if not pose_filter:
        config = replace(config, pose_filter=None)
    return MetricGraphNavAgent(loaded.pose, loaded.steering, camera, config)

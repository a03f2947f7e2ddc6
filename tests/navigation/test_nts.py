"""The agent of Neural Topological SLAM in a room made of four walls."""

import math

import numpy as np
import pytest
import torch

from toponav.core.geometry import Pose2, wrap_angle
from toponav.core.imagenav import Action, ImageGoal, ImageNavAgent, PanoramaObservation
from toponav.models.nts.network import NTSNetwork
from toponav.models.nts.panorama import column_yaw_rad, horizontal_scale
from toponav.models.nts.presets import NTSConfig
from toponav.navigation.nts.agent import NTSAgent, NTSAgentConfig
from toponav.navigation.nts.local_map import LocalMap
from toponav.navigation.nts.local_policy import LocalPolicy
from toponav.navigation.nts.map_kernels import march
from toponav.navigation.nts.pose_tracking import PoseTracker
from toponav.navigation.nts.registration import align, register, signature

_SIZE_M = (5.0, 3.5)
_POST = (2.9, 1.5, 0.25)


def _see(pose: Pose2) -> tuple[np.ndarray, np.ndarray]:
    """Panorama and depth in a room with coloured walls and a round post."""
    yaw = column_yaw_rad(512) + pose.yaw_rad
    dx, dy = np.cos(yaw), np.sin(yaw)
    with np.errstate(divide="ignore"):
        across = np.where(dx > 0, (_SIZE_M[0] - pose.x_m) / dx, -pose.x_m / dx)
        along = np.where(dy > 0, (_SIZE_M[1] - pose.y_m) / dy, -pose.y_m / dy)
    range_m = np.minimum(across, along)
    x_m, y_m = pose.x_m + range_m * dx, pose.y_m + range_m * dy
    color = np.stack([40 + 40 * x_m, 40 + 50 * y_m, 60 + 60 * (np.sin(3 * x_m) > 0)], axis=1)
    off_x, off_y = _POST[0] - pose.x_m, _POST[1] - pose.y_m
    ahead, aside = off_x * dx + off_y * dy, off_x * dy - off_y * dx
    hit = (np.abs(aside) < _POST[2]) & (ahead > 0)
    range_m = np.where(hit, ahead - np.sqrt(np.maximum(_POST[2] ** 2 - aside**2, 0)), range_m)
    color[hit] = (250, 10, 10)
    depth_m = np.repeat((range_m / horizontal_scale(512))[None], 128, axis=0)
    rows = (64 - np.arange(128) - 0.5) / 64
    with np.errstate(divide="ignore"):
        floor_m = np.where(rows < 0, -0.6 / rows, np.inf)
    rgb = np.where((depth_m > floor_m[:, None])[..., None], 90, color[None]).astype(np.uint8)
    depth_m = np.minimum(depth_m, floor_m[:, None]).astype(np.float32)
    return rgb, np.clip(depth_m, 0.1, 10.0)


class _Room:
    """A stand-in for the simulation, with a wheel that slips."""

    def __init__(self, start: Pose2, seed: int = 0, *, noise: float = 0.02) -> None:
        self.start, self.pose, self.step = start, start, 0
        self.odometry = Pose2(0.0, 0.0, 0.0)
        self.collided, self.collisions = False, 0
        self._rng, self._noise = np.random.default_rng(seed), noise

    def observe(self) -> PanoramaObservation:
        return PanoramaObservation(*_see(self.pose), self.odometry, self.collided, self.step)

    def move(self, action: Action) -> None:
        forward = 0.25 if action is Action.FORWARD else 0.0
        turn = {Action.LEFT: 10.0, Action.RIGHT: -10.0}.get(action, 0.0)
        step = Pose2(forward, 0.0, math.radians(turn))
        new = self.pose.compose(step)
        inside = all(0.18 < v < s - 0.18 for v, s in zip(new[:2], _SIZE_M, strict=True))
        clear = math.dist(new[:2], _POST[:2]) > _POST[2] + 0.18
        self.collided = not (inside and clear)
        self.collisions += self.collided
        self.step += 1
        if self.collided:
            return
        self.pose = new
        slip = self._rng.normal(0.0, self._noise, 3)
        self.odometry = self.odometry.compose(
            Pose2(step.x_m + slip[0], slip[1], step.yaw_rad + slip[2])
        )


def _network(*, depth: bool = True) -> NTSNetwork:
    torch.manual_seed(0)
    return NTSNetwork(NTSConfig(depth=depth, width=8, features=16, hidden=16))


def _agent(**changes: bool) -> NTSAgent:
    return NTSAgent(_network(), NTSAgentConfig(**changes))


def test_agent_keeps_the_protocol() -> None:
    assert isinstance(_agent(), ImageNavAgent)


@pytest.mark.parametrize("changes", [{}, {"use_graph": False}, {"use_score": False}])
def test_goal_in_sight_is_reached_and_stopped_at(changes: dict[str, bool]) -> None:
    room, goal = _Room(Pose2(0.8, 0.8, 2.0)), Pose2(4.2, 2.6, -1.0)
    agent = _agent(**changes)
    agent.reset(ImageGoal(*_see(goal)))
    for _ in range(120):
        action = agent.act(room.observe())
        if action is Action.STOP:
            break
        room.move(action)
    assert action is Action.STOP
    assert room.pose.distance_to(goal) < 0.75
    assert agent.belief().stopped_because
    assert agent.belief().goal is not None


def test_same_seed_acts_the_same() -> None:
    actions = []
    for _ in range(2):
        room, agent = _Room(Pose2(0.8, 0.8, 2.0), seed=3), _agent()
        agent.reset(ImageGoal(*_see(Pose2(4.2, 2.6, -1.0))))
        taken = []
        for _ in range(12):
            taken.append(agent.act(room.observe()))
            room.move(taken[-1])
        actions.append(taken)
    assert actions[0] == actions[1]


def test_broken_goal_ends_the_episode_with_a_reason() -> None:
    agent = _agent()
    agent.reset(ImageGoal(np.zeros((64, 64, 3), np.uint8), None))
    assert agent.act(_Room(Pose2(1.0, 1.0, 0.0)).observe()) is Action.STOP
    assert "128x512" in agent.belief().stopped_because


def test_dead_cameras_and_jumping_wheels_raise_nothing() -> None:
    room, agent = _Room(Pose2(0.8, 0.8, 0.0)), _agent()
    agent.reset(ImageGoal(*_see(Pose2(4.2, 2.6, -1.0))))
    for number in range(8):
        seen = room.observe()
        rgb, depth_m, odometry = seen.rgb, seen.depth_m, seen.odometry
        if number in (2, 3):
            rgb = np.zeros_like(rgb)
        if number == 4:
            depth_m = np.full_like(depth_m, np.nan)
        if number == 5:
            odometry = Pose2(50.0, -20.0, 1.0)
        if number == 6:
            odometry = Pose2(math.nan, 0.0, 0.0)
        action = agent.act(PanoramaObservation(rgb, depth_m, odometry, None, seen.step))
        room.move(action)
    assert agent.belief().pose is not None
    assert agent.belief().pose.distance_to(Pose2(0.0, 0.0, 0.0)) < 3.0


def test_registration_finds_the_pose_of_a_picture() -> None:
    here, there = Pose2(1.0, 1.0, 0.4), Pose2(3.9, 2.7, -2.0)
    one, other = signature(*_see(here)), signature(*_see(there))
    truth = there.relative_to(here)
    for found in (register(one, other, 4.0), align(one, other, truth)):
        assert found.pose.distance_to(truth) < 0.15
        assert abs(wrap_angle(found.pose.yaw_rad - truth.yaw_rad)) < 0.1
        assert found.score > 0.6


def test_views_take_back_what_wheels_lost() -> None:
    room = _Room(Pose2(0.7, 0.7, 0.2), noise=0.04)
    tracker, action = PoseTracker(aligned=True), None
    for number in range(30):
        seen = room.observe()
        tracker.update(seen.odometry, signature(seen.rgb, seen.depth_m), action)
        action = Action.FORWARD if number % 3 == 0 and number < 20 else Action.LEFT
        room.move(action)
    seen = room.observe()
    tracker.update(seen.odometry, signature(seen.rgb, seen.depth_m), action)
    truth = room.pose.relative_to(room.start)
    assert tracker.pose.distance_to(truth) < 0.12
    assert tracker.pose.distance_to(truth) < room.odometry.distance_to(truth)


def test_local_policy_drives_around_the_post() -> None:
    room, policy = _Room(Pose2(1.5, 1.5, 0.0), noise=0.0), LocalPolicy()
    target = Pose2(4.3, 1.5, 0.0)
    local = target.relative_to(room.start)
    for _ in range(60):
        policy.observe(room.observe(), room.pose.relative_to(room.start))
        if room.pose.distance_to(target) < 0.3:
            break
        room.move(policy.action((local.x_m, local.y_m)))
    assert room.pose.distance_to(target) < 0.3
    assert room.collisions == 0


def test_map_knows_the_walls_and_what_is_free() -> None:
    one, start = LocalMap(), Pose2(1.0, 1.0, 0.0)
    one.add_depth(_see(start)[1], Pose2(0.0, 0.0, 0.0))
    assert one.evidence[one.cell_of(1.0, 1.0)] < 0
    row, col = one.cell_of(-1.0, 0.3)
    assert one.evidence[row, col - 1 : col + 2].max() > 0
    assert one.evidence[one.cell_of(-2.0, 0.0)] == 0


def test_marching_measures_straight_distances() -> None:
    time = march(np.ones((41, 41)), np.array([20]), np.array([20]), -1, -1, 0.0)
    assert time[20, 40] == pytest.approx(20.0, abs=1e-6)
    assert time[35, 35] == pytest.approx(15.0 * math.sqrt(2.0), rel=0.06)

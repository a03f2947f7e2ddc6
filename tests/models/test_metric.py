"""Obstacle profiles, local maps, map pictures, the pose filter and the two networks."""

import math

import numpy as np
import pytest
import torch

from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.plan import shortest_plan
from toponav.maps.spec import MapFrame, Node, TopologicalMap, edge_along
from toponav.models.checkpoints import load_checkpoint, save_checkpoint
from toponav.models.graphnav.metric.local_map import LocalMap, LocalMapConfig
from toponav.models.graphnav.metric.map_picture import MAP_CHANNELS, PLAN_FEATURES, MapArrays
from toponav.models.graphnav.metric.odometry import CommandOdometry, motion_steps
from toponav.models.graphnav.metric.pose_filter import PoseFilter, PoseFilterConfig
from toponav.models.graphnav.metric.pose_network import PoseNetwork
from toponav.models.graphnav.metric.presets import PictureConfig, PoseConfig, best_preset
from toponav.models.graphnav.metric.profile import BANDS_M, DepthProfiler, bin_azimuths_rad
from toponav.models.graphnav.metric.steering import (
    STEERING_FEATURES,
    SteeringNetwork,
    steering_features,
)
from toponav.models.graphnav.preprocess import frame_reducer

IMAGE = best_preset().image
CAMERA = PinholeCamera()


def wall_ahead_m(depth_m: float) -> np.ndarray:
    return np.full((240, 320), depth_m, np.float32)


def slow_profile(depth_m: np.ndarray) -> np.ndarray:
    """The obvious way: every pixel to a point, every point to its bins."""
    out = np.full((2, IMAGE.cols), 255, np.uint8)
    rays = CAMERA.rays_in_robot()
    edges = np.arange(CAMERA.width + 1) - CAMERA.width / 2
    place = (0.5 + np.arctan(edges / CAMERA.focal_px) / IMAGE.hfov_rad) * IMAGE.cols
    for col in range(CAMERA.width):
        first, last = int(place[col] + 1e-6), math.ceil(place[col + 1] - 1e-6) - 1
        for row in range(CAMERA.height):
            depth = depth_m[row, col]
            if not 0 < depth < IMAGE.max_depth_m:
                continue
            height = CAMERA.mount_height_m + rays[row, col, 2] * depth
            for band, (low, high) in enumerate(BANDS_M):
                if low < height < high:
                    byte = int(depth / IMAGE.max_depth_m * 254 + 0.5)
                    for bin_ in range(max(first, 0), min(max(first, last), IMAGE.cols - 1) + 1):
                        out[band, bin_] = min(out[band, bin_], byte)
    return out


def t_map() -> TopologicalMap:
    nodes = (
        Node("a", NodeKind.ROOM, 0.0, 0.0, room="a"),
        Node("a_door", NodeKind.DOOR, 2.0, 0.0, room="a"),
        Node("hall", NodeKind.HALLWAY, 4.0, 0.0),
        Node("b", NodeKind.ROOM, 4.0, 3.0, room="b"),
    )
    edges = (
        edge_along(nodes[0], nodes[1], Behavior.FIND_DOOR),
        edge_along(nodes[1], nodes[2], Behavior.STRAIGHT),
        edge_along(nodes[2], nodes[3], Behavior.TURN_LEFT),
    )
    return TopologicalMap("t", MapFrame(), nodes, edges)


@pytest.fixture
def arrays() -> MapArrays:
    topological_map = t_map()
    return MapArrays.of(topological_map, shortest_plan(topological_map, "a", "b"))


def test_profile_is_what_every_pixel_says_one_by_one():
    rng = np.random.default_rng(0)
    depth = np.repeat(rng.uniform(0.4, 4.5, (240, 20)), 16, axis=1).astype(np.float32)
    depth[rng.random(depth.shape) < 0.05] = 0.0
    fast = DepthProfiler(CAMERA, best_preset())(depth)
    assert (np.abs(fast.astype(int) - slow_profile(depth)) <= 1).mean() > 0.999


def test_low_obstacle_does_not_show_among_walls():
    depth = wall_ahead_m(9.0)
    rays = CAMERA.rays_in_robot()
    box = np.abs(CAMERA.mount_height_m + rays[..., 2] * 1.0 - 0.3) < 0.1
    depth[box] = 1.0
    low, walls = DepthProfiler(CAMERA, best_preset())(depth)
    assert low.max() == round(254 / 3.5)
    assert (walls == 255).all()


def test_profiler_refuses_what_it_cannot_use():
    profiler = DepthProfiler(CAMERA, best_preset())
    with pytest.raises(InputError, match="240 rows"):
        profiler(np.ones((10, 10), np.float32))
    with pytest.raises(InputError, match="finite"):
        profiler(np.full((240, 320), np.nan, np.float32))
    for camera in (
        PinholeCamera(pitch_rad=0.3),
        PinholeCamera(hfov_rad=1.0),
        PinholeCamera(max_depth_m=2.0),
    ):
        with pytest.raises(InputError):
            frame_reducer(camera, best_preset())


def test_wall_ahead_is_drawn_where_it_is():
    local_map = LocalMap(IMAGE, LocalMapConfig())
    profiler = DepthProfiler(CAMERA, best_preset())
    for _ in range(3):
        local_map.insert(profiler(wall_ahead_m(2.0)))
    view = local_map.view(0.1)
    ahead = view[:, 32] >> 4
    assert ahead[32 + 19 : 32 + 22].max() > 11
    assert ahead[33:50].max() < 3, "the way to the wall is free"
    assert ahead[:30].min() == ahead[:30].max() == 7, "nothing is known behind"


def test_local_map_stays_in_place_while_the_robot_moves():
    local_map = LocalMap(IMAGE, LocalMapConfig())
    profiler = DepthProfiler(CAMERA, best_preset())
    for _ in range(4):
        local_map.insert(profiler(wall_ahead_m(2.0)))
    for _ in range(10):
        local_map.advance(np.array([0.1, 0.0, 0.0]))
    ahead = local_map.view(0.1)[:, 32] >> 4
    assert 9 <= int(ahead[32:].argmax()) <= 11
    for _ in range(9):
        local_map.advance(np.array([0.0, 0.0, math.pi / 18]))
    right = local_map.view(0.1)[32] >> 4
    assert 9 <= 32 - int(right[:32].argmax()) <= 12, "the wall is now to the right"


def test_what_is_left_far_behind_is_forgotten():
    local_map = LocalMap(IMAGE, LocalMapConfig())
    profiler = DepthProfiler(CAMERA, best_preset())
    local_map.insert(profiler(wall_ahead_m(2.0)))
    for step in (0.5, -0.5):
        for _ in range(60):
            local_map.advance(np.array([step, 0.0, 0.0]))
    assert (local_map.view(0.1) == 0x77).all()


def test_picture_shows_the_map_as_seen_from_the_pose(arrays):
    out = np.empty((MAP_CHANNELS, 64, 64), np.float32)
    arrays.draw(np.array([2.0, 0.0, 0.0]), 2.0, 0.1, out)
    assert out[1].argmax() // 64 in (31, 32)
    assert out[1].argmax() % 64 in (31, 32)
    assert out[0, 12, 32] > 0.5, "the room's node is two metres behind"
    assert out[2, 52, 32] > 0.5, "the hall is two metres ahead"
    arrays.draw(np.array([2.0, 0.0, math.pi / 2]), 2.0, 0.1, out)
    assert out[2, 32, 12] > 0.5, "turned left, the hall is to the right"


def test_progress_and_plan_features_follow_the_plan(arrays):
    assert arrays.progress_m(3.0, 0.4, 0.0, 10.0) == pytest.approx(3.0)
    assert arrays.progress_m(3.0, 0.4, 0.0, 2.0) == pytest.approx(2.0)
    features = arrays.plan_features(np.array([3.5, 0.0, 0.0]), 3.5)
    assert features.shape == (PLAN_FEATURES,)
    points = features[:14].reshape(7, 2) * 4.0
    assert points[2] == pytest.approx([0.5, 0.5], abs=1e-5), "a metre ahead is round the corner"
    assert features[14] == pytest.approx(3.5 / 8)
    order = list(Behavior)
    assert features[15:20].argmax() == order.index(Behavior.STRAIGHT)
    assert features[20:25].argmax() == order.index(Behavior.TURN_LEFT)


def test_odometry_adds_up_to_the_commanded_way():
    commands = np.tile([0.5, 0.0], (50, 1))
    steps = motion_steps(commands, np.arange(50) == 0)
    assert steps[:, 0].sum() == pytest.approx(5.0, rel=0.02)
    one = CommandOdometry().step(commands[1], commands[0])
    assert steps[1] == pytest.approx(one)


def test_filter_finds_a_pose_that_it_is_told_again_and_again():
    beliefs = PoseFilter(np.zeros((1, 3)))
    truth = np.array([1.0, -0.5, 0.2])
    for _ in range(60):
        c, s = np.cos(beliefs.pose[0, 2]), np.sin(beliefs.pose[0, 2])
        away = truth - beliefs.pose[0]
        seen = [away[0] * c + away[1] * s, -away[0] * s + away[1] * c, away[2]]
        beliefs.predict(np.zeros((1, 3)))
        beliefs.correct(np.array([seen]), np.array([[0.1, 0.1, 0.05]]))
    assert beliefs.pose[0] == pytest.approx(truth, abs=0.02)
    assert (beliefs.std_in_robot < 0.15).all()


def test_filter_spreads_along_the_way_and_keeps_robots_apart():
    config = PoseFilterConfig(start_std_m=0.01, start_std_rad=0.1)
    beliefs = PoseFilter(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, math.pi / 2]]), config)
    for _ in range(50):
        beliefs.predict(np.array([[0.1, 0.0, 0.0], [0.1, 0.0, 0.0]]))
    assert beliefs.pose[0] == pytest.approx([5.0, 0.0, 0.0], abs=1e-9)
    assert beliefs.pose[1] == pytest.approx([0.0, 5.0, math.pi / 2], abs=1e-9)
    std = beliefs.std_in_robot
    assert std[0] == pytest.approx(std[1])
    assert std[0, 1] > 0.3, "a heading off by a tenth ends half a metre to the side"
    with pytest.raises(InputError, match="slip"):
        PoseFilterConfig(slip=-1.0)


def small_pose_network() -> PoseNetwork:
    return PoseNetwork(PoseConfig(picture=PictureConfig((8, 8), 16, 0.0)))


def test_pose_network_learns_to_see_an_offset(arrays):
    torch.manual_seed(0)
    rng = np.random.default_rng(0)
    network = small_pose_network()
    optimizer = torch.optim.Adam(network.parameters(), 3e-3)
    maps = torch.full((16, 64, 64), 0x77, dtype=torch.uint8)
    first = last = 0.0
    for step in range(40):
        left = rng.uniform(-0.8, 0.8, 16)
        pictures = np.empty((16, MAP_CHANNELS, 64, 64), np.float32)
        for i in range(16):
            arrays.draw(np.array([3.0, -left[i], 0.0]), 3.0, 0.1, pictures[i])
        truth = torch.zeros(16, 3)
        truth[:, 1] = torch.from_numpy(left)
        loss = network.loss(*network(maps, torch.from_numpy(pictures)), truth).mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        first, last = (loss.item() if step == 0 else first), loss.item()
    assert last < first - 2.0


def test_networks_come_back_from_their_checkpoints(tmp_path):
    preset = best_preset()
    for network in (small_pose_network(), SteeringNetwork(preset.steering)):
        path = save_checkpoint(network, tmp_path / network.kind)
        again = load_checkpoint(path)
        assert again.config == network.config
        for name, value in network.state_dict().items():
            assert torch.equal(value, again.state_dict()[name])


def test_every_parameter_of_the_steering_network_learns():
    preset = best_preset()
    network = SteeringNetwork(preset.steering)
    outputs = network(
        torch.randint(0, 255, (4, 64, 64), dtype=torch.uint8),
        torch.rand(4, MAP_CHANNELS, 64, 64),
        torch.randint(0, 255, (4, 2, 128), dtype=torch.uint8),
        torch.rand(4, STEERING_FEATURES),
    )
    network.head.loss(outputs, torch.rand(4, 2)).mean().backward()
    assert all(value.grad is not None for value in network.parameters())


def test_steering_features_are_shares_of_limits():
    limits = best_preset().steering.limits
    features = steering_features(
        np.zeros((1, PLAN_FEATURES), np.float32),
        np.array([[0.25, -1.5]]),
        np.array([[0.1, 9.0, 0.05]]),
        limits,
    )
    assert features[0, PLAN_FEATURES:] == pytest.approx([0.5, -1.0, 0.1, 2.0, 0.2])


def test_azimuths_run_from_left_to_right():
    azimuths = bin_azimuths_rad(IMAGE)
    assert azimuths[0] > 0 > azimuths[-1]
    assert np.allclose(np.diff(azimuths), np.diff(azimuths)[0], atol=1e-5)

"""Training preset best on a tiny dataset: pose network, replayed beliefs, steering network."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.data.small_office import save_building
from toponav.core.camera import PinholeCamera
from toponav.core.episode import Observation, Velocity
from toponav.data.collect import CollectConfig, collect
from toponav.data.noise import NoiseConfig
from toponav.data.prepare import prepare
from toponav.data.storage import read_trajectory
from toponav.maps.task import NavigationTask
from toponav.models.checkpoints import (
    holds_metric_weights,
    load_checkpoint,
    load_metric_weights,
)
from toponav.models.graphnav.metric.map_picture import MAP_CHANNELS
from toponav.models.graphnav.metric.presets import best_preset
from toponav.navigation.graphnav.metric_agent import load_metric_agent
from toponav.training.belief_replay import replay_beliefs
from toponav.training.config import TrainingConfig
from toponav.training.metric_data import MetricData
from toponav.training.metric_recipe import (
    open_metric_data,
    train_judge,
    train_pose,
    train_steering,
)
from toponav.training.place_samples import replay_hypotheses
from toponav.training.pose_task import believed_from, seen_from
from toponav.training.release import release_weights

CAMERA = PinholeCamera(160, 120)
CONFIG = TrainingConfig(
    epochs=1,
    samples_per_epoch=96,
    batch_size=16,
    learning_rate=1e-3,
    weight_decay=0.0,
    schedule="one_cycle",
    ema=0.9,
    mirror=True,
    most_validation_samples=32,
    precision="float32",
)


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("metric")
    building = save_building(folder)
    config = CollectConfig(
        episodes=4,
        seed=3,
        buildings=(str(building),),
        episodes_per_building=2,
        camera=CAMERA,
        noise=NoiseConfig(1.0),
    )
    collect(folder / "drives", config)
    prepare(folder / "drives", folder / "cache", "best")
    return folder / "cache"


@pytest.fixture(scope="module")
def weights(cache: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("weights")
    preset = best_preset()
    sets = open_metric_data([cache], preset)
    train_pose(sets, preset, CONFIG, out)
    train_steering(sets, preset, CONFIG, out)
    return out


def test_offset_of_a_belief_is_seen_from_it():
    rng = np.random.default_rng(0)
    true, offset = rng.normal(size=(2, 50, 3))
    assert seen_from(believed_from(true, offset), true) == pytest.approx(offset)


def test_local_maps_are_made_once(cache):
    first = MetricData(cache, best_preset().pose.local_map)
    stamp = (cache / "local_maps_far.npy").stat().st_mtime_ns
    again = MetricData(cache, best_preset().pose.local_map)
    assert (cache / "local_maps_far.npy").stat().st_mtime_ns == stamp
    assert np.array_equal(first.far, again.far)
    assert (first.near != 0x77).any()


def test_progress_grows_along_a_drive(cache):
    one = MetricData(cache, best_preset().pose.local_map)
    progress = one.true_progress()[one.data.rows_of(0)]
    _, arc = one.arrays_of(0).way()
    assert progress[-1] > 0.7 * arc[-1]
    assert (np.diff(progress) > -0.3).all()


def test_trained_weights_are_found_and_released(weights, tmp_path):
    assert holds_metric_weights(weights)
    released = release_weights(weights, tmp_path / "released")
    assert released["bytes"] < 10e6
    assert load_metric_weights(tmp_path / "released").pose.config == best_preset().pose


def test_network_that_learned_to_judge_weighs_hypotheses(cache, weights, tmp_path):
    preset = best_preset()
    sets = open_metric_data([cache], preset)
    result = train_judge(sets, preset, CONFIG, weights, tmp_path, drives=3)
    assert 0.0 <= result.metrics["judged_right"] <= 1.0
    again = train_judge(sets, preset, CONFIG, weights, tmp_path, drives=3)
    assert again.metrics == result.metrics
    assert holds_metric_weights(tmp_path), "with the steering network of before"
    network = load_checkpoint(tmp_path / "pose")
    before = load_metric_weights(weights).pose
    assert network.config == replace(before.config, judges=True)
    picture = torch.zeros((1, MAP_CHANNELS, 64, 64))
    *_, log_odds = network.judged(torch.from_numpy(sets[0].far[:1]), picture)
    assert log_odds.shape == (1,)


def test_hypotheses_are_noted_near_the_robot_and_elsewhere(cache, weights):
    one = MetricData(cache, best_preset().pose.local_map)
    noted = replay_hypotheses(one, load_metric_weights(weights).pose, np.random.default_rng(0))
    away_m = np.hypot(*(noted.pose[:, :2] - one.data.pose[noted.row, :2]).T)
    assert len(noted) > 30
    assert (away_m < 1.0).any()
    assert (away_m > 1.6).any()
    assert (noted.bounds_m[:, 0] <= noted.bounds_m[:, 1]).all()


def test_agent_in_use_believes_what_the_replay_does(cache, weights):
    """Training replays beliefs in batches; the robot keeps one: both must be the same."""
    one = MetricData(cache, best_preset().pose.local_map)
    replayed = replay_beliefs(one, load_metric_weights(weights).pose)
    drive = read_trajectory(cache.parent / "drives" / "trajectories" / "000000.mcap")
    agent = load_metric_agent(
        str(weights), pose_filter=True, camera=CAMERA, without=["hypotheses"]
    )
    agent.reset(NavigationTask(one.data.map_of(0), one.data.plan_of(0)))
    for step in range(25):
        depth_m = drive.depth_mm[step].astype(np.float32) * np.float32(0.001)
        agent.act(Observation(depth_m, 0.2 * step))
        assert agent.pose == pytest.approx(replayed.pose[step], abs=2e-3)
        agent.overruled(Velocity(*drive.executed[step].tolist()))


def test_agent_stops_on_a_frame_that_it_cannot_trust(cache, weights):
    one = MetricData(cache, best_preset().pose.local_map)
    agent = load_metric_agent(str(weights), pose_filter=True, camera=CAMERA)
    agent.reset(NavigationTask(one.data.map_of(0), one.data.plan_of(0)))
    command = agent.act(Observation(np.full((120, 160), np.nan, np.float32), 0.0))
    assert command.linear_m_s == command.angular_rad_s == 0.0
    assert agent.belief().stopped_because

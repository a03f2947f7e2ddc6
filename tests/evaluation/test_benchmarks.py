"""Benchmarks measure every way in the same run and say what they measured on."""

import json

import numpy as np
import pytest

from tests.sim.buildings import furnished_room
from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.evaluation.benchmarks.closed_loop import (
    ConstantAgent,
    LoopTimes,
    measure_closed_loop,
    time_closed_loop,
)
from toponav.evaluation.benchmarks.record import Benchmark, write_benchmark
from toponav.evaluation.benchmarks.render import frames_per_second
from toponav.evaluation.suite import suite_of
from toponav.maps.construct import map_from_layout
from toponav.sim.simulation import Simulation
from toponav.worlds.generate.office import generate_office


def test_every_camera_is_timed_in_every_repeat() -> None:
    frames = {"grid": 3, "packets": 2, "embreex": 2}
    rates = frames_per_second(furnished_room(), PinholeCamera(32, 24), 2, frames=frames)
    assert set(rates) == set(frames)
    assert all(values.shape == (2,) and (values > 0).all() for values in rates.values())


def test_closed_loop_times_each_part_of_each_step() -> None:
    scene = generate_office(0, size="small")
    suite = suite_of(scene, map_from_layout(scene), episodes=2, seed=0)
    simulation = Simulation(scene, PinholeCamera(16, 12))
    times = time_closed_loop(simulation, ConstantAgent(), suite, steps=12)
    assert times.physics_s.shape == times.camera_s.shape == times.agent_s.shape == (12,)
    assert times.physics_s.sum() > times.agent_s.sum()


def test_real_time_factor_is_simulated_over_spent_seconds() -> None:
    ten_ms = np.full(5, 0.01)
    times = LoopTimes(physics_s=ten_ms, camera_s=ten_ms, agent_s=2 * ten_ms)
    assert times.real_time_factor() == pytest.approx(0.2 / 0.04)
    assert times.real_time_factor(agent=False) == pytest.approx(0.2 / 0.02)


def test_result_file_names_commit_hardware_and_settings(tmp_path) -> None:
    benchmark = Benchmark("render", {"fps": 1234.5678}, {"seed": 3})
    document = json.loads(write_benchmark(benchmark, tmp_path).read_text())
    assert document["metrics"] == {"fps": 1235.0}
    assert document["settings"] == {"seed": 3}
    assert document["hardware"]["cores"] >= 1
    assert {"commit", "versions"} <= set(document)
    assert [path.name for path in tmp_path.iterdir()] == ["render.json"]


def test_agents_that_need_the_truth_are_refused() -> None:
    with pytest.raises(InputError, match="'expert' is shown the truth"):
        measure_closed_loop("expert")
    with pytest.raises(InputError, match="did you mean 'graphnav_pf'"):
        measure_closed_loop("graphnav_fp")

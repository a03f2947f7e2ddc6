import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from tests.data.conftest import EPISODES
from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior
from toponav.data import prepare as prepare_module
from toponav.data.dataset import trajectory_path
from toponav.data.prepare import prepare
from toponav.data.storage import read_trajectory
from toponav.data.training_set import TrainingSet, _long_runs
from toponav.models.graphnav.preprocess import DepthResampler
from toponav.models.graphnav.presets import get_preset


@pytest.fixture(scope="module")
def cache(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("cache") / "compact"
    prepare(finished, out, "compact")
    return out


def test_frames_are_what_an_agent_sees(cache: Path, finished: Path) -> None:
    data = TrainingSet.open(cache)
    resampler = DepthResampler(PinholeCamera(80, 60), get_preset("compact"))
    for trajectory in (0, EPISODES - 1):
        recording = read_trajectory(trajectory_path(finished, trajectory))
        rows = data.rows_of(trajectory)
        assert rows.stop - rows.start == len(recording)
        np.testing.assert_array_equal(data.command[rows], recording.command)
        np.testing.assert_allclose(data.pose[rows], recording.pose, atol=1e-5)
        for frame in (0, 17):
            seen = resampler(recording.depth_mm[frame].astype(np.float32) / np.float32(1000))
            assert abs(data.frames[rows][frame].astype(int) - seen).max() <= 1


def test_rows_are_contiguous_by_trajectory_with_map_and_plan(cache: Path) -> None:
    data = TrainingSet.open(cache)
    assert (np.diff(data.trajectory) >= 0).all()
    assert data.trajectories == EPISODES
    assert len(data) == len(data.frames) == data.starts[-1]
    assert isinstance(data.frames, np.memmap)
    for trajectory in range(EPISODES):
        topological_map, plan = data.map_of(trajectory), data.plan_of(trajectory)
        assert data.building_of(trajectory) == "small_office"
        assert data.map_of(trajectory) is topological_map
        rows = data.rows_of(trajectory)
        edges = {topological_map.edges[e].id for e in np.unique(data.edge[rows]) if e >= 0}
        assert edges <= set(plan.edges)
        assert len(edges) >= 3


def test_the_behaviour_by_plan_is_that_of_the_edge(cache: Path) -> None:
    data = TrainingSet.open(cache)
    edges = data.map_of(0).edges
    for row in np.flatnonzero(data.edge >= 0)[::7]:
        assert list(Behavior)[data.behavior[row]] == edges[data.edge[row]].behavior
    assert set(data.behavior.tolist()) >= {0, 1}


def test_heuristic_labels_are_those_of_the_table(cache: Path, finished: Path) -> None:
    data = TrainingSet.open(cache, labels="heuristic")
    table = pq.read_table(finished / "annotations.parquet")
    names = [None if code < 0 else list(Behavior)[code] for code in data.behavior.tolist()]
    assert names == table["behavior"].to_pylist()
    nodes = data.map_of(0).nodes
    found = [None if node < 0 else nodes[node].id for node in data.node.tolist()]
    assert found == table["node"].to_pylist()


def test_a_robot_astray_for_a_second_has_no_edge() -> None:
    flags = np.array([1, 1, 0, 1, 1, 1, 1, 1, 0, 1, 1, 1, 1, 1], bool)
    trajectory = np.array([0] * 11 + [1] * 3, np.int32)
    assert _long_runs(flags, trajectory).tolist() == [False] * 3 + [True] * 5 + [False] * 6


def test_several_caches_become_one_set(cache: Path) -> None:
    one, two = TrainingSet.open(cache), TrainingSet.open([cache, cache])
    assert two.trajectories == 2 * one.trajectories
    np.testing.assert_array_equal(two.frames[len(one) :], one.frames)
    np.testing.assert_array_equal(two.trajectory[len(one) :], one.trajectory + EPISODES)
    assert two.plan_of(EPISODES + 1) == one.plan_of(1)


def test_a_single_building_is_all_for_training(cache: Path) -> None:
    data = TrainingSet.open(cache)
    assert len(data.split("train")) == len(data) == len(data.split("all"))
    assert len(data.split("val")) == 0


def test_a_finished_cache_is_opened_and_an_interrupted_one_resumed(
    finished: Path, cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(prepare_module, "_PER_TASK", 1)
    original, calls = prepare_module._resample_some, []

    def dies_at_third(*args: object) -> None:
        calls.append(args)
        if len(calls) == 3:
            raise KeyboardInterrupt
        original(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(prepare_module, "_resample_some", dies_at_third)
    with pytest.raises(KeyboardInterrupt):
        prepare(finished, tmp_path / "out", "compact")
    with pytest.raises(InputError, match=r"holds cache\.json"):
        TrainingSet.open(tmp_path / "out")
    data = prepare(finished, tmp_path / "out", "compact")
    assert len(calls) == 3 + EPISODES - 2
    np.testing.assert_array_equal(data.frames, TrainingSet.open(cache).frames)
    prepare(finished, tmp_path / "out", "compact")
    assert len(calls) == 3 + EPISODES - 2


def test_broken_caches_and_mixed_images_are_refused(
    cache: Path, finished: Path, tmp_path: Path
) -> None:
    broken = Path(shutil.copytree(cache, tmp_path / "broken"))
    frames = (broken / "frames.npy").read_bytes()
    (broken / "frames.npy").write_bytes(frames[: len(frames) // 2])
    with pytest.raises(InputError, match=r"frames\.npy: does not hold the array"):
        TrainingSet.open(broken)
    other = Path(shutil.copytree(cache, tmp_path / "other"))
    document = json.loads((other / "cache.json").read_text())
    document["image"]["projection"] = "pinhole"
    (other / "cache.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match="must have the same image"):
        TrainingSet.open([cache, other])

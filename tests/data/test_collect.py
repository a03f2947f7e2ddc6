import dataclasses
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from tests.data.conftest import EPISODES
from toponav.core.episode import Observation, Velocity
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.data.buildings import load_building, resolve_buildings
from toponav.data.collect import CollectConfig, collect
from toponav.data.dataset import (
    building_dir,
    locked,
    read_manifest,
    recorded,
    trajectory_path,
)
from toponav.data.export import export_npz
from toponav.data.storage import read_trajectory
from toponav.maps.task import NavigationTask
from toponav.sim.render import make_renderer
from toponav.sim.simulation import SimState


def digests(dataset: Path) -> dict[int, str]:
    listed = read_manifest(dataset).trajectories
    return {index: digest for index, (digest, _) in listed.items()}


def test_a_collection_is_complete_indexed_labelled_and_listed(finished: Path) -> None:
    manifest = read_manifest(finished)
    assert manifest.complete
    assert sorted(manifest.trajectories) == recorded(finished) == list(range(EPISODES))
    index = pq.read_table(finished / "index.parquet").to_pylist()
    frames = sum(row["frames"] for row in index)
    assert pq.read_table(finished / "annotations.parquet").num_rows == frames
    assert {row["building"] for row in index} == {"small_office"} == set(manifest.buildings)
    assert [row["outcome"] for row in index] == ["success"] * EPISODES
    assert CollectConfig.from_dict(manifest.config).to_dict().items() <= manifest.config.items()


def test_a_drive_goes_from_its_start_to_its_goal_and_a_second_further(finished: Path) -> None:
    building = load_building(building_dir(finished, "small_office"))
    for index in range(EPISODES):
        recording = read_trajectory(trajectory_path(finished, index))
        plan = recording.metadata.plan
        first, last = recording.pose[0], recording.pose[-1]
        assert building.scene.room_at(*first[:2]) == building.map.node(plan.nodes[0]).room
        assert building.scene.room_at(*last[:2]) == building.map.node(plan.nodes[-1]).room
        assert recording.metadata.scene_hash == building.scene.content_hash
        assert recording.depth_mm.shape == (len(recording), 60, 80)
        assert recording.depth_mm.max() <= 3500
        assert abs(recording.executed - recording.command).max() > 0.01
        assert (abs(recording.velocity[:, 0]) <= 0.55).all()


def test_the_data_do_not_depend_on_the_number_of_workers(
    config: CollectConfig, finished: Path, tmp_path: Path
) -> None:
    collect(tmp_path / "two", config, workers=2)
    assert digests(tmp_path / "two") == digests(finished)
    for name in ("index.parquet", "annotations.parquet"):
        ours, theirs = (pq.read_table(d / name) for d in (tmp_path / "two", finished))
        assert ours.equals(theirs)


_COLLECT = """
import sys
from pathlib import Path
from toponav.core.camera import PinholeCamera
from toponav.data.collect import CollectConfig, collect
from toponav.data.noise import NoiseConfig
collect(Path(sys.argv[1]), CollectConfig(
    episodes=int(sys.argv[3]), seed=5, buildings=(sys.argv[2],), episodes_per_building=2,
    camera=PinholeCamera(80, 60), noise=NoiseConfig(2.0)))
"""


def test_kill_nine_loses_and_doubles_nothing(
    config: CollectConfig, building: Path, finished: Path, tmp_path: Path
) -> None:
    out = tmp_path / "killed"
    process = subprocess.Popen([sys.executable, "-c", _COLLECT, str(out), str(building), "400"])
    deadline = time.monotonic() + 120
    while len(recorded(out)) < 2 and time.monotonic() < deadline:
        assert process.poll() is None
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    kept = {index: trajectory_path(out, index).stat().st_mtime_ns for index in recorded(out)}
    assert len(kept) >= 2
    assert not read_manifest(out).complete
    (out / "trajectories" / ".000003.mcap.1.partial").write_bytes(b"half a fi")
    more = dataclasses.replace(config, episodes=max(EPISODES, max(kept) + 1))
    # The killed command wanted 400: the manifest remembers, so it is told to want fewer.
    manifest = out / "dataset.json"
    manifest.write_text(manifest.read_text().replace(": 400,", f": {more.episodes},"))
    collect(out, more)
    assert recorded(out) == list(range(more.episodes))
    assert not list(out.glob("**/.*.partial"))
    for index, written_ns in kept.items():
        assert trajectory_path(out, index).stat().st_mtime_ns == written_ns
    found = digests(out)
    assert {index: found[index] for index in range(EPISODES)} == digests(finished)


def test_more_episodes_are_added_to_what_is_there(config: CollectConfig, dataset: Path) -> None:
    before = digests(dataset)
    collect(dataset, dataclasses.replace(config, episodes=EPISODES + 1))
    after = digests(dataset)
    assert len(after) == EPISODES + 1
    assert before.items() <= after.items()


def test_a_finished_collection_is_not_touched_by_another_run(
    config: CollectConfig, dataset: Path
) -> None:
    times = [path.stat().st_mtime_ns for path in sorted((dataset / "trajectories").iterdir())]
    collect(dataset, config)
    again = [path.stat().st_mtime_ns for path in sorted((dataset / "trajectories").iterdir())]
    assert times == again


def test_another_configuration_is_refused_by_name(config: CollectConfig, dataset: Path) -> None:
    with pytest.raises(InputError, match="another seed: seed = 5"):
        collect(dataset, dataclasses.replace(config, seed=6))


def test_two_commands_cannot_write_at_once(config: CollectConfig, dataset: Path) -> None:
    with locked(dataset), pytest.raises(InputError, match="only one command"):
        collect(dataset, config)


def test_unknown_buildings_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    config = CollectConfig(episodes=1, buildings=("offices-tran",))
    with pytest.raises(InputError, match="did you mean 'offices-train'"):
        collect(tmp_path / "new", config)
    assert not (tmp_path / "new").exists()


def test_offices_of_a_dataset_follow_its_seed() -> None:
    names = [resolve_buildings(["offices-train"], seed)(0).name for seed in (0, 1)]
    assert names[0] != names[1]
    assert resolve_buildings(["offices-train"], 1)(0).name == names[1]


class _Wall:
    """A driver that turns on the spot and never gets anywhere."""

    source = "idler"

    def __call__(self) -> "_Wall":
        return self

    def reset(self, task: NavigationTask, random: np.random.Generator, attempt: int) -> None:
        self.task = task

    def act(
        self, observation: Observation, state: SimState, expert: Velocity, node: str | None
    ) -> Velocity:
        return Velocity(0.0, 0.0)


def test_a_learner_may_drive_while_the_expert_labels(
    config: CollectConfig, tmp_path: Path
) -> None:
    one = dataclasses.replace(config, episodes=1, attempts=1)
    collect(tmp_path / "dagger", one, driver=_Wall())
    recording = read_trajectory(trajectory_path(tmp_path / "dagger", 0))
    assert recording.metadata.source == "idler"
    assert recording.end.outcome == "stuck"
    assert (recording.executed == 0.0).all()
    assert abs(recording.command).max() > 0.1


def test_colours_and_classes_are_collected_on_request(
    config: CollectConfig, finished: Path, tmp_path: Path
) -> None:
    wanted = dataclasses.replace(config, episodes=1, images=("rgb", "semantic"))
    manifest = collect(tmp_path / "seen", wanted, annotate=False)
    assert manifest.config["images"] == ["rgb", "semantic"]
    assert "images" not in read_manifest(finished).config
    recording = read_trajectory(trajectory_path(tmp_path / "seen", 0), rgb=True, semantic=True)
    plain = read_trajectory(trajectory_path(finished, 0))
    # The drive is the same one; its depth comes from another cast.
    np.testing.assert_array_equal(recording.pose, plain.pose)
    assert (abs(recording.depth_mm.astype(int) - plain.depth_mm) <= 2).mean() > 0.99
    assert recording.rgb.shape == (len(recording), 60, 80, 3)
    scene = load_building(building_dir(tmp_path / "seen", "small_office")).scene
    seen = make_renderer(scene, wanted.camera).render_images(Pose2(*recording.pose[7].tolist()))
    np.testing.assert_array_equal(recording.semantic[7], seen.semantic)
    np.testing.assert_array_equal(recording.rgb[7], seen.rgb)
    with pytest.raises(InputError, match="another images"):
        collect(tmp_path / "seen", dataclasses.replace(wanted, images=("rgb",)))


def test_exported_archives_hold_the_colours(config: CollectConfig, tmp_path: Path) -> None:
    wanted = dataclasses.replace(config, episodes=1, images=("rgb",))
    collect(tmp_path / "seen", wanted, annotate=False)
    assert export_npz(tmp_path / "seen", tmp_path / "npz") == 1
    archive = np.load(tmp_path / "npz" / "000000.npz")
    assert archive["rgb"].shape[1:] == (60, 80, 3)
    assert "semantic" not in archive

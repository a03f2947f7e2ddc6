"""Real rclpy: a drive is recorded by another process, and becomes a dataset."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from tests.ros.conftest import AGENT, Floor
from toponav.cli.main import main
from toponav.core.geometry import Pose2
from toponav.data.dataset import read_manifest, trajectory_path
from toponav.data.storage import check_bag, read_trajectory
from toponav.data.verify import verify_dataset
from toponav.evaluation.suite import seed_of

pytestmark = [
    pytest.mark.ros,
    pytest.mark.filterwarnings("ignore:module 'sre_:DeprecationWarning"),
]


@pytest.fixture(scope="module")
def driven(lockstep: Any, floor: Floor, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A bag of `toponav ros record`, with the true poses and commands by stamp."""
    from toponav.ros.harness import RosProcess

    lockstep.restore()
    lockstep.revive()
    # Lock-step waits for the agent, not for who only listens.
    lockstep.limit(rate=2.0)
    task, folder = floor.tasks[0], tmp_path_factory.mktemp("record")
    words = ["record", "--map", str(floor.map), "--sim-time", "--out", str(folder / "0.mcap")]
    words += ["--start", task.plan.nodes[0], "--goal", task.plan.nodes[-1]]
    recorder = RosProcess(words, folder / "record.log")
    poses: list[Pose2] = []

    def note(seen: Any) -> None:
        if seen.ends_step:
            poses.append(seen.state.pose)

    try:
        lockstep.node.run(lambda: recorder.is_over() or lockstep.is_listened_to("toponav_record"))
        lockstep.drive(
            task.plan,
            task.start,
            seed=seed_of("episode", 0, AGENT, task.index),
            on_step=note,
            until=lambda: len(poses) >= 40,
        )
        recorder.interrupt()
        recorder.process.wait(60.0)
    finally:
        recorder.close()
    assert recorder.process.returncode == 0, (folder / "record.log").read_text()
    return folder / "0.mcap", task, poses


def test_what_is_recorded_is_what_was_driven(driven: Any, floor: Floor) -> None:
    bag, task, poses = driven
    recording = read_trajectory(bag, validate=True)
    assert check_bag(bag) == ""
    assert 30 <= len(recording) <= 45
    assert recording.metadata.plan == task.plan
    driven_m = sum(np.hypot(b.x_m - a.x_m, b.y_m - a.y_m) for a, b in itertools.pairwise(poses))
    recorded_m = np.linalg.norm(np.diff(recording.pose[:, :2], axis=0), axis=1).sum()
    assert recorded_m == pytest.approx(driven_m, rel=0.1, abs=0.2)
    # The commands of the bag are those that the agent gives without ROS, in this order.
    without = [(s.linear_m_s, s.angular_rad_s) for s in floor.without_ros(task).steps]
    found = np.isclose(np.array(without)[:, None], recording.command[None], atol=1e-6).all(-1)
    assert found.any(0).mean() > 0.9
    assert recording.depth_mm.max() > 1000


def test_a_recorded_drive_becomes_a_dataset(driven: Any, floor: Floor, tmp_path: Path) -> None:
    bag, _, _ = driven
    out = tmp_path / "data"
    words = ["data", "import-bag", str(bag), "--out", str(out), "--building", str(floor.building)]
    assert main(words) == 0
    assert read_manifest(out).complete
    assert verify_dataset(out) == []
    imported, recorded = read_trajectory(trajectory_path(out, 0)), read_trajectory(bag)
    np.testing.assert_array_equal(imported.depth_mm, recorded.depth_mm)
    np.testing.assert_allclose(imported.pose, recorded.pose)
    np.testing.assert_allclose(imported.command, recorded.command)


def test_other_tools_open_the_bag(driven: Any) -> None:
    bag, _, _ = driven
    recording = read_trajectory(bag)
    with AnyReader([bag]) as reader:
        images = [c for c in reader.connections if c.msgtype == "sensor_msgs/msg/Image"]
        seen = [reader.deserialize(data, c.msgtype) for c, _, data in reader.messages(images)]
    assert len(seen) == len(recording)
    assert (seen[0].height, seen[0].width) == recording.depth_mm.shape[1:]

    with bag.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        decoded = [m for _, c, _, m in reader.iter_decoded_messages() if c.topic.endswith("odom")]
    assert len(decoded) == len(recording)
    assert decoded[0].header.frame_id

"""Bags as another robot's driver writes them: 30 Hz, 16UC1, a narrow camera, unstamped Twist."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from toponav.cli.main import main
from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.data.dataset import read_manifest, trajectory_path
from toponav.data.import_bag import BagTopics, import_bag
from toponav.data.storage import check_bag, read_trajectory
from toponav.data.verify import verify_dataset
from toponav.maps.construct import map_from_layout
from toponav.maps.plan import Plan
from toponav.maps.spec import save_map
from toponav.worlds.generate.office import generate_office
from toponav.worlds.storage import save_scene

STORE = get_typestore(Stores.ROS2_JAZZY)
T: Any = STORE.types
TOPICS = BagTopics("/oakd/stereo/image_raw", "/oakd/stereo/camera_info")
SPEED = 0.3


@pytest.fixture(scope="module")
def floor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scenes") / "floor"
    scene = generate_office(3, "small")
    save_scene(scene, folder)
    save_map(map_from_layout(scene), folder / "map.topo.json")
    return folder


@pytest.fixture(scope="module")
def plan(floor: Path) -> Plan:
    from toponav.maps.spec import load_map

    edge = load_map(floor / "map.topo.json").edges[0]
    return Plan((edge.source, edge.target), (edge.id,))


def stamp(time_s: float) -> Any:
    seconds = int(time_s)
    time = T["builtin_interfaces/msg/Time"](seconds, int((time_s - seconds) * 1e9))
    return T["std_msgs/msg/Header"](time, "camera")


def depth_message(time_s: float, metres: float) -> Any:
    pixels = np.full((60, 80), round(1000 * metres), np.uint16)
    return T["sensor_msgs/msg/Image"](
        stamp(time_s), 60, 80, "16UC1", 0, 160, pixels.view(np.uint8).ravel()
    )


def info_message(time_s: float) -> Any:
    k = np.array([60, 0, 39.5, 0, 60, 29.5, 0, 0, 1.0])
    return T["sensor_msgs/msg/CameraInfo"](
        stamp(time_s), 60, 80, "plumb_bob", np.zeros(5), k, np.eye(3).ravel(), np.zeros(12),
        0, 0, T["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False),
    )  # fmt: skip


def twist(linear: float) -> Any:
    vector = T["geometry_msgs/msg/Vector3"]
    return T["geometry_msgs/msg/Twist"](vector(linear, 0.0, 0.0), vector(0.0, 0.0, 0.1))


def odometry_message(time_s: float) -> Any:
    """Drives along the odometry frame's y, from (5, 7)."""
    half = math.pi / 4
    pose = T["geometry_msgs/msg/Pose"](
        T["geometry_msgs/msg/Point"](5.0, 7.0 + SPEED * time_s, 0.0),
        T["geometry_msgs/msg/Quaternion"](0.0, 0.0, math.sin(half), math.cos(half)),
    )
    return T["nav_msgs/msg/Odometry"](
        stamp(time_s), "base_link",
        T["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36)),
        T["geometry_msgs/msg/TwistWithCovariance"](twist(SPEED), np.zeros(36)),
    )  # fmt: skip


def write_bag(folder: Path, plugin: StoragePlugin, without: str = "") -> Path:
    messages = []
    for n in range(90):
        messages.append((n / 30, TOPICS.depth, depth_message(n / 30, 1.0 + n / 100)))
        messages.append((n / 30, TOPICS.camera_info, info_message(n / 30)))
    messages += [(n / 20, TOPICS.odom, odometry_message(n / 20)) for n in range(60)]
    messages += [(n / 10, TOPICS.cmd_vel, twist(0.01 * n)) for n in range(30)]
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        found = {}
        for time_s, topic, message in sorted(messages, key=lambda each: each[0]):
            if topic == without:
                continue
            kind = message.__msgtype__
            if topic not in found:
                found[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(found[topic], int(time_s * 1e9), STORE.serialize_cdr(message, kind))
    return folder


@pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_a_foreign_bag_becomes_a_trajectory_at_5_hz(
    plugin: StoragePlugin, floor: Path, plan: Plan, tmp_path: Path
) -> None:
    bag = write_bag(tmp_path / "bag", plugin)
    camera = PinholeCamera(mount_height_m=0.24)
    out = tmp_path / "data"
    import_bag(bag, out, floor, plan, topics=TOPICS, camera=camera)
    recording = read_trajectory(trajectory_path(out, 0), validate=True)
    assert len(recording) in (14, 15)
    assert recording.metadata.plan == plan
    assert recording.metadata.camera == camera
    # What the narrow camera sees is in the middle; the rest are holes.
    np.testing.assert_allclose(recording.depth_mm[5, 120, 160], 1000 + 10 * 30, atol=40)
    assert recording.depth_mm[5, 120, 0] == 0
    # From the first node along the first edge, whatever the odometry's frame is.
    driven = np.linalg.norm(recording.pose[-1, :2] - recording.pose[0, :2])
    assert driven == pytest.approx(SPEED * 14 * 0.2, abs=0.05)
    assert verify_dataset(out) == []
    # The command that answers a frame: at the latest a tenth of a second after it.
    assert recording.command[5, 0] == pytest.approx(0.11, abs=0.011)


def test_bags_are_added_one_by_one(floor: Path, plan: Plan, tmp_path: Path) -> None:
    bag, out = write_bag(tmp_path / "bag", StoragePlugin.MCAP), tmp_path / "data"
    words = ["data", "import-bag", str(bag), "--out", str(out), "--building", str(floor)]
    words += ["--start", plan.nodes[0], "--goal", plan.nodes[1], "--robot", "turtlebot4"]
    assert main(words) == 0
    assert main(words) == 0
    manifest = read_manifest(out)
    assert (manifest.episodes, manifest.complete) == (2, True)
    assert check_bag(trajectory_path(out, 1)) == ""
    # A bag of ours brings its own plan and poses.
    own = [*words[:2], str(trajectory_path(out, 0)), *words[3:7], "--robot", "turtlebot4"]
    assert main(own) == 0
    first, third = (read_trajectory(trajectory_path(out, index)) for index in (0, 2))
    np.testing.assert_array_equal(first.pose, third.pose)
    np.testing.assert_array_equal(first.depth_mm, third.depth_mm)


@pytest.mark.parametrize("topic", [TOPICS.odom, TOPICS.cmd_vel, TOPICS.camera_info])
def test_a_missing_topic_is_named(topic: str, floor: Path, plan: Plan, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", StoragePlugin.MCAP, without=topic)
    with pytest.raises(InputError, match=topic):
        import_bag(bag, tmp_path / "data", floor, plan, topics=TOPICS)


def test_a_broken_bag_and_a_plan_left_out_are_told(
    floor: Path, plan: Plan, tmp_path: Path
) -> None:
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(b"\x89MCAP0\r\n" + bytes(50))
    with pytest.raises(InputError, match="cannot be read"):
        import_bag(broken, tmp_path / "data", floor, plan)
    with pytest.raises(InputError, match="what was driven"):
        import_bag(broken, tmp_path / "data", floor)

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.data import storage
from toponav.data.recording import TrajectoryMetadata
from toponav.data.storage import (
    TrajectoryWriter,
    check_bag,
    depth_images,
    read_summary,
    read_trajectory,
)
from toponav.maps.plan import Plan

FRAMES = 12


def metadata(width: int = 32, height: int = 24) -> TrajectoryMetadata:
    return TrajectoryMetadata(
        index=7,
        dataset_seed=3,
        building="büro",
        scene_hash="s",
        map_hash="m",
        plan=Plan(("a", "b"), ("a->b",)),
        camera=PinholeCamera(width, height),
        noise_scale=2.0,
    )


def depth_m(frame: int) -> np.ndarray:
    image = np.full((24, 32), 0.001 * frame, np.float32)
    image[:, 16:] = 3.5
    image[0, 0] = 0.0
    return image


def write(path: Path, frames: int = FRAMES) -> storage.StoredTrajectory:
    writer = TrajectoryWriter(path, metadata())
    for frame in range(frames):
        writer.append(
            depth_m(frame),
            Pose2(0.1 * frame, -2.0, 3.0),
            Velocity(0.25, 0.5),
            Velocity(0.5, -1.0 * frame),
            Velocity(0.375, 0.125),
        )
    return writer.finish("collided", "wall")


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    return write(tmp_path / "000007.mcap").path


def test_what_is_read_is_what_was_written(bag: Path) -> None:
    recording = read_trajectory(bag, validate=True)
    assert recording.metadata == metadata()
    assert (recording.end.outcome, recording.end.contact) == ("collided", "wall")
    assert recording.end.frames == len(recording) == FRAMES
    assert recording.end.distance_m == pytest.approx(0.1 * (FRAMES - 1))
    np.testing.assert_allclose(recording.time_s, 0.2 * np.arange(FRAMES), atol=1e-9)
    np.testing.assert_allclose(recording.pose[:, 0], 0.1 * np.arange(FRAMES))
    np.testing.assert_allclose(recording.pose[:, 1:], [[-2.0, 3.0]] * FRAMES)
    np.testing.assert_allclose(recording.velocity, [[0.25, 0.5]] * FRAMES)
    np.testing.assert_allclose(recording.command[:, 1], -1.0 * np.arange(FRAMES))
    np.testing.assert_allclose(recording.executed, [[0.375, 0.125]] * FRAMES)


def test_depth_is_stored_in_whole_millimetres_and_holes_stay_zero(bag: Path) -> None:
    images = read_trajectory(bag).depth_mm
    assert images.dtype == np.uint16
    assert images[5, 3, 3] == 5
    assert images[5, 3, 20] == 3500
    assert images[5, 0, 0] == 0
    for image, streamed in zip(images, depth_images(bag), strict=True):
        np.testing.assert_array_equal(image, streamed)


def test_images_can_be_left_out(bag: Path) -> None:
    assert read_trajectory(bag, depth=False).depth_mm.shape == (0, 24, 32)


def test_other_readers_open_the_bag_and_see_the_same(bag: Path) -> None:
    ours = read_trajectory(bag)
    seen: dict[str, list] = {}
    with AnyReader([bag]) as reader:
        for connection, time_ns, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            seen.setdefault(connection.topic, []).append((connection.msgtype, time_ns, message))
    kind, time_ns, image = seen["/camera/depth/image_raw"][5]
    assert (kind, time_ns, image.encoding) == ("sensor_msgs/msg/Image", 10**9, "16UC1")
    assert (image.header.stamp.sec, image.header.stamp.nanosec) == (1, 0)
    pixels = image.data.view("<u2").reshape(image.height, image.width)
    np.testing.assert_array_equal(pixels, ours.depth_mm[5])
    kind, _, odometry = seen["/odom"][5]
    assert (kind, odometry.header.frame_id) == ("nav_msgs/msg/Odometry", "map")
    assert odometry.pose.pose.position.x == pytest.approx(0.5)
    rotation = odometry.pose.pose.orientation
    assert 2 * math.atan2(rotation.z, rotation.w) == pytest.approx(3.0)
    assert odometry.twist.twist.angular.z == 0.5
    kind, _, command = seen["/cmd_vel"][5]
    assert kind == "geometry_msgs/msg/TwistStamped"
    assert (command.twist.linear.x, command.twist.angular.z) == (0.5, -5.0)
    assert seen["/cmd_vel_executed"][5][2].twist.linear.x == 0.375
    kind, _, text = seen["/toponav/trajectory"][0]
    assert kind == "std_msgs/msg/String"
    assert json.loads(text.data)["plan"]["edges"] == ["a->b"]
    info = seen["/camera/depth/camera_info"][0][2]
    assert info.k[0] == pytest.approx(metadata().camera.focal_px)
    assert {len(messages) for topic, messages in seen.items() if "toponav" not in topic} == {
        1,
        FRAMES,
    }


def test_the_same_drive_gives_the_same_bytes(tmp_path: Path) -> None:
    first, second = write(tmp_path / "1.mcap"), write(tmp_path / "2.mcap")
    assert first.sha256 == second.sha256
    assert first.path.read_bytes() == second.path.read_bytes()


def test_the_summary_agrees_with_the_file(tmp_path: Path) -> None:
    stored = write(tmp_path / "1.mcap")
    assert read_summary(stored.path) == (metadata(), stored.end, stored.sha256, stored.size_bytes)


def test_nothing_is_left_behind_where_a_writer_dies_before_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def dies(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("os.replace", dies)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "1.mcap")
    assert list(tmp_path.iterdir()) == []


def test_an_empty_trajectory_is_whole(tmp_path: Path) -> None:
    stored = write(tmp_path / "1.mcap", frames=0)
    assert check_bag(stored.path) == ""
    assert read_trajectory(stored.path).depth_mm.shape == (0, 24, 32)


def test_every_flipped_byte_is_found(bag: Path) -> None:
    content = bag.read_bytes()
    assert check_bag(bag) == ""
    for at in np.random.default_rng(0).integers(0, len(content), 60).tolist():
        bag.write_bytes(content[:at] + bytes([content[at] ^ 0x10]) + content[at + 1 :])
        assert check_bag(bag), at


def test_every_cut_file_is_found(bag: Path) -> None:
    content = bag.read_bytes()
    for length in (0, 5, 9, 100, len(content) // 2, len(content) - 9, len(content) - 1):
        bag.write_bytes(content[:length])
        assert check_bag(bag), length


def test_errors_name_the_file_and_the_remedy(bag: Path, tmp_path: Path) -> None:
    bag.write_bytes(b"not a bag")
    with pytest.raises(InputError, match=r"000007\.mcap.*must be whole.*data verify"):
        read_trajectory(bag)
    with pytest.raises(InputError, match=r"missing\.mcap: .*no such file"):
        read_summary(tmp_path / "missing.mcap")


def write_with_images(path: Path, frames: int = 3) -> Path:
    writer = TrajectoryWriter(path, dataclasses.replace(metadata(), images=("rgb", "semantic")))
    for frame in range(frames):
        rgb = np.full((24, 32, 3), (frame, 10, 20), np.uint8)
        rgb[0, 1] = (200, 100, 50)
        semantic = np.full((24, 32), frame, np.uint8)
        still = Velocity(0.0, 0.0)
        images = {"rgb": rgb, "semantic": semantic}
        writer.append(depth_m(frame), Pose2(0.0, 0.0, 0.0), still, still, still, images)
    return writer.finish("success").path


def test_colours_and_classes_are_read_when_asked_for(tmp_path: Path) -> None:
    bag = write_with_images(tmp_path / "000007.mcap")
    recording = read_trajectory(bag, rgb=True, semantic=True, validate=True)
    assert recording.metadata.images == ("rgb", "semantic")
    assert recording.rgb.shape == (3, 24, 32, 3)
    assert recording.rgb[2, 0, 1].tolist() == [200, 100, 50]
    assert recording.rgb[2, 5, 5].tolist() == [2, 10, 20]
    assert (recording.semantic == np.arange(3)[:, None, None]).all()
    np.testing.assert_array_equal(recording.depth_mm[1], read_trajectory(bag).depth_mm[1])
    assert read_trajectory(bag).rgb.shape == (0, 24, 32, 3)
    assert check_bag(bag) == ""


def test_other_readers_see_the_colours(tmp_path: Path) -> None:
    bag = write_with_images(tmp_path / "000007.mcap")
    with AnyReader([bag]) as reader:
        images = {
            connection.topic: reader.deserialize(raw, connection.msgtype)
            for connection, _, raw in reader.messages()
            if connection.topic in ("/camera/color/image_raw", "/camera/semantic/image_raw")
        }
    color, classes = images["/camera/color/image_raw"], images["/camera/semantic/image_raw"]
    assert (color.encoding, color.step, classes.encoding) == ("rgb8", 96, "mono8")
    assert color.data.reshape(24, 32, 3)[0, 1].tolist() == [200, 100, 50]


def test_images_that_were_not_recorded_are_asked_for_in_vain(bag: Path) -> None:
    with pytest.raises(InputError, match="recorded without rgb"):
        read_trajectory(bag, rgb=True)


def test_depth_alone_is_stored_as_before_there_were_other_images(bag: Path) -> None:
    assert "images" not in json.loads(metadata().to_json())
    with AnyReader([bag]) as reader:
        assert {one.topic for one in reader.connections} >= {"/odom", "/camera/depth/image_raw"}
        assert not {one.topic for one in reader.connections if "color" in one.topic}

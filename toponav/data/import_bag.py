"""Bags of any robot into a dataset, so that networks can be tuned on one's own floor."""

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from jaxtyping import Float64
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.core.files import check_out_folder
from toponav.core.geometry import Pose2
from toponav.data.buildings import Building, make_building, resolve_buildings
from toponav.data.collect import finish_dataset
from toponav.data.dataset import (
    Manifest,
    environment,
    locked,
    read_manifest,
    recorded,
    trajectory_path,
    write_manifest,
)
from toponav.data.image_messages import (
    CameraModel,
    Reprojector,
    depth_of_image,
    pose_in_map,
    without_holes,
)
from toponav.data.recording import TrajectoryMetadata
from toponav.data.storage import TrajectoryWriter, read_summary, read_trajectory
from toponav.maps.plan import Plan

__all__ = ["BagTopics", "import_bag"]

_PERIOD_S: Final = 0.2
_ANSWER_S: Final = 0.1
_FURTHEST_S: Final = 0.5
_NS: Final = 1e9


@dataclass(frozen=True)
class BagTopics:
    """What a bag calls things."""

    depth: str = "/camera/depth/image_raw"
    camera_info: str = "/camera/depth/camera_info"
    odom: str = "/odom"
    cmd_vel: str = "/cmd_vel"


@dataclass
class _Track:
    """Times in seconds and rows of numbers."""

    times: list[float] = field(default_factory=list)
    rows: list[tuple[float, ...]] = field(default_factory=list)

    def arrays(self) -> tuple[Float64[np.ndarray, " n"], Float64[np.ndarray, "n width"]]:
        order = np.argsort(self.times, kind="stable")
        return np.array(self.times)[order], np.array(self.rows, np.float64)[order]


def import_bag(
    bag: Path,
    out: Path,
    building: Path,
    plan: Plan | None = None,
    *,
    topics: BagTopics | None = None,
    camera: PinholeCamera | None = None,
    outcome: str = "success",
    annotate: bool = True,
) -> Manifest:
    """Adds the drive in a bag to a dataset, which is made where it is missing.

    Frames are taken five times a second and brought to the camera that networks are trained
    with. The robot stands at the plan's first node when the first frame is taken, looking along
    its first edge; odometry tells where it went from there. A bag of `toponav ros record` or
    `toponav collect` brings its own plan and poses.

    Args:
        bag: An `.mcap` file, a rosbag2 folder, or a ROS 1 `.bag`.
        out: Folder of the dataset.
        building: Folder of a scene with its map.topo.json, or an area's yaml.
        plan: What was driven, for bags that do not say it.
        topics: What the bag calls things.
        camera: The camera to bring frames to.
        outcome: How the drive ended.
        annotate: Whether to label the dataset afterwards.

    Raises:
        InputError: The bag cannot be read or lacks a topic, or the dataset is another one.
    """
    check_out_folder(out)
    camera = camera or PinholeCamera()
    source = resolve_buildings((str(building),), 0)(0)
    with locked(out):
        manifest = _begin(out, camera)
        made = make_building(source, out)
        index = manifest.episodes
        path = trajectory_path(out, index)
        path.parent.mkdir(exist_ok=True)
        _copy(bag, path, made, index, plan, topics or BagTopics(), camera, outcome)
        grown = dataclasses.replace(manifest, episodes=index + 1, complete=False)
        write_manifest(out, grown)
        return finish_dataset(out, grown, annotate=annotate)


def _begin(out: Path, camera: PinholeCamera) -> Manifest:
    """The dataset to add to."""
    config = {"source": "import-bag", "camera": dataclasses.asdict(camera)}
    if not (out / "dataset.json").exists():
        if recorded(out):
            raise InputError(
                "the folder holds trajectories but no dataset.json",
                where=str(out),
                remedy="give an empty folder",
            )
        return Manifest("graphnav", 0, config, environment())
    found = read_manifest(out)
    if found.config.get("source") != "import-bag":
        raise InputError(
            "the dataset there was collected, not imported",
            where=str(out),
            remedy="import into a folder of its own; `toponav train` takes several",
        )
    if found.config.get("camera") != config["camera"]:
        raise InputError(
            "the dataset there was imported for another camera",
            where=str(out),
            remedy="give the same --camera-height-m, or another folder",
        )
    # What an interrupted import left is written again.
    return found


def _copy(
    bag: Path,
    path: Path,
    building: Building,
    index: int,
    plan: Plan | None,
    topics: BagTopics,
    camera: PinholeCamera,
    outcome: str,
) -> None:
    own = _own_bag(bag)
    if own is not None:
        plan = plan or own
    if plan is None:
        raise InputError(
            "what was driven must be said: the bag does not",
            where=str(bag),
            remedy="give --start NODE --goal NODE",
        )
    _check_plan(plan, building, bag)
    metadata = TrajectoryMetadata(
        index=index,
        dataset_seed=0,
        building=building.name,
        scene_hash=building.scene.content_hash,
        map_hash=building.map_hash,
        plan=plan,
        camera=camera,
        source="bag",
        noise_scale=0.0,
    )
    writer = TrajectoryWriter(path, metadata)
    if own is not None:
        outcome = _copy_own(bag, writer, camera)
    else:
        first = building.map.node(plan.nodes[0])
        yaw_rad = building.map.edge(plan.edges[0]).yaw_rad
        _copy_foreign(bag, writer, Pose2(first.x_m, first.y_m, yaw_rad), topics, camera)
    if writer.frames == 0:
        raise InputError(
            "no depth frame has odometry near it in time",
            where=str(bag),
            remedy="record both on one clock, and at least for a second",
        )
    writer.finish(outcome)


def _own_bag(bag: Path) -> Plan | None:
    """The plan of a bag that toponav wrote, or None for another's."""
    if bag.suffix != ".mcap" or not bag.is_file():
        return None
    try:
        return read_summary(bag)[0].plan
    except InputError:
        return None


def _check_plan(plan: Plan, building: Building, bag: Path) -> None:
    for node in plan.nodes:
        building.map.node(node)
    for edge in plan.edges:
        building.map.edge(edge)
    if not plan.edges:
        raise InputError("a plan has an edge", where=str(bag), remedy="give another --goal")


def _copy_own(bag: Path, writer: TrajectoryWriter, camera: PinholeCamera) -> str:
    recording = read_trajectory(bag)
    project = Reprojector(CameraModel.of(recording.metadata.camera), camera)
    for row in range(len(recording)):
        writer.append(
            project(recording.depth_mm[row].astype(np.float32) / np.float32(1000.0)),
            Pose2(*recording.pose[row].tolist()),
            Velocity(*recording.velocity[row].tolist()),
            Velocity(*recording.command[row].tolist()),
            Velocity(*recording.executed[row].tolist()),
        )
    return recording.end.outcome


def _copy_foreign(
    bag: Path, writer: TrajectoryWriter, start: Pose2, topics: BagTopics, camera: PinholeCamera
) -> None:
    odometry, commands, model = _tracks(bag, topics)
    project = Reprojector(model, camera)
    odometry_s, poses = odometry.arrays()
    told_s, told = commands.arrays()
    due_s, first = -np.inf, None
    for time_s, message in _messages(bag, {topics.depth}):
        nearest = int(np.abs(odometry_s - time_s).argmin())
        if time_s < due_s or abs(odometry_s[nearest] - time_s) > _FURTHEST_S:
            continue
        due_s = time_s + 0.9 * _PERIOD_S
        x, y, yaw, linear, angular = poses[nearest].tolist()
        first = first or Pose2(x, y, yaw)
        at = int(np.searchsorted(told_s, time_s + _ANSWER_S, side="right")) - 1
        is_told = at >= 0 and time_s - told_s[at] <= _FURTHEST_S
        command = Velocity(*told[at].tolist()) if is_told else Velocity(0.0, 0.0)
        depth_m = without_holes(project(_depth(message)), camera.max_depth_m)
        pose = pose_in_map(Pose2(x, y, yaw), first, start)
        writer.append(depth_m, pose, Velocity(linear, angular), command, command)


def _depth(message: Any) -> np.ndarray:
    return depth_of_image(
        message.encoding,
        message.height,
        message.width,
        message.step,
        bool(message.is_bigendian),
        message.data,
    )


def _tracks(bag: Path, topics: BagTopics) -> tuple[_Track, _Track, CameraModel]:
    """Odometry, commands, and the depth camera."""
    odometry, commands, model = _Track(), _Track(), None
    for time_s, message in _messages(bag, {topics.odom, topics.cmd_vel, topics.camera_info}):
        kind = message.__msgtype__.rsplit("/", 1)[-1]
        if kind == "CameraInfo":
            k = getattr(message, "k", None)
            k = message.K if k is None else k
            model = CameraModel(message.width, message.height, k[0], k[4], k[2], k[5])
        elif kind == "Odometry":
            odometry.times.append(time_s)
            odometry.rows.append(_odometry_row(message))
        elif kind in ("Twist", "TwistStamped"):
            twist = message.twist if kind == "TwistStamped" else message
            commands.times.append(time_s)
            commands.rows.append((twist.linear.x, twist.angular.z))
    found = {topics.odom: odometry.times, topics.cmd_vel: commands.times}
    missing = [topic for topic, times in found.items() if not times]
    if model is None:
        missing.append(topics.camera_info)
    if missing or model is None:
        raise InputError(
            f"the bag has nothing on {', '.join(missing)}",
            where=str(bag),
            remedy="name its topics: --robot, or --depth-topic, --info-topic, --odom-topic and "
            "--cmd-vel-topic; `ros2 bag info` lists them",
        )
    return odometry, commands, model


def _odometry_row(message: Any) -> tuple[float, ...]:
    place, turned = message.pose.pose.position, message.pose.pose.orientation
    yaw = np.arctan2(
        2 * (turned.w * turned.z + turned.x * turned.y),
        1 - 2 * (turned.y**2 + turned.z**2),
    )
    twist = message.twist.twist
    row = (place.x, place.y, float(yaw), twist.linear.x, twist.angular.z)
    if not np.isfinite(row).all():
        raise ValueError("odometry that is not finite")
    return row


def _messages(bag: Path, topics: set[str]) -> Iterator[tuple[float, Any]]:
    """Arrival time in seconds and message, in order, of some topics."""
    if not bag.exists():
        raise InputError("there is no such bag", where=str(bag), remedy="check the path")
    try:
        with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
            wanted = [each for each in reader.connections if each.topic in topics]
            if not wanted:
                names = ", ".join(sorted({each.topic for each in reader.connections})[:20])
                raise InputError(
                    f"the bag has no {' or '.join(sorted(topics))}; it has {names}",
                    where=str(bag),
                    remedy="name its topics with --robot, --depth-topic and the like",
                )
            for connection, time_ns, raw in reader.messages(connections=wanted):
                yield time_ns / _NS, reader.deserialize(raw, connection.msgtype)
    except (InputError, OSError, MemoryError):
        raise
    except Exception as error:
        raise InputError(
            f"the bag cannot be read: {(str(error) or type(error).__name__)[:300]}",
            where=str(bag),
            remedy="check it with `ros2 bag info`; `ros2 bag reindex` or `mcap recover` may help",
        ) from error

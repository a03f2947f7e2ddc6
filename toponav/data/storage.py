"""A trajectory as one MCAP bag of standard ROS 2 messages: written whole or not at all.

`ros2 bag info`, Foxglove, `rosbags` and `mcap-ros2-support` open the files: the profile is
ros2 and every schema travels inside. A file is written under a `.partial` name, flushed to
disk and renamed, so a file with its final name is complete whatever was killed.
"""

import hashlib
import io
import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np
import zstandard
from jaxtyping import Float32, UInt16
from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Chunk
from mcap.stream_reader import CRCValidationError, StreamReader
from mcap.writer import Writer

from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.core.files import read_bytes, write_atomically
from toponav.core.geometry import Pose2
from toponav.data.bag_images import (
    DEPTH_TOPIC,
    EXTRA_ENCODINGS,
    EXTRA_TOPICS,
    image_readers,
    kept_images,
)
from toponav.data.messages import (
    ImageCodec,
    OdometryCodec,
    TwistCodec,
    camera_info,
    definition_of,
    text_message,
)
from toponav.data.recording import ExtraImage, Recording, TrajectoryEnd, TrajectoryMetadata

__all__ = [
    "StoredTrajectory",
    "TrajectoryWriter",
    "check_bag",
    "depth_images",
    "read_summary",
    "read_trajectory",
    "write_atomically",
]

CAMERA_TOPIC: Final = "/camera/depth/camera_info"
ODOMETRY_TOPIC: Final = "/odom"
COMMAND_TOPIC: Final = "/cmd_vel"
EXECUTED_TOPIC: Final = "/cmd_vel_executed"
METADATA_TOPIC: Final = "/toponav/trajectory"
END_TOPIC: Final = "/toponav/end"

_TOPICS: Final = {
    METADATA_TOPIC: "std_msgs/msg/String",
    CAMERA_TOPIC: "sensor_msgs/msg/CameraInfo",
    DEPTH_TOPIC: ImageCodec.TYPE,
    ODOMETRY_TOPIC: OdometryCodec.TYPE,
    COMMAND_TOPIC: TwistCodec.TYPE,
    EXECUTED_TOPIC: TwistCodec.TYPE,
    END_TOPIC: "std_msgs/msg/String",
}
_RECORD = "toponav"
_MAX_BAG_BYTES = 2 << 30
_MAX_CHUNK_BYTES = 256 << 20
_LARGEST = 1e6
_MESSAGE_OPCODE = 5
_UNREADABLE = (
    McapError,
    CRCValidationError,
    ValueError,
    KeyError,
    IndexError,
    TypeError,
    OverflowError,
    MemoryError,
    EOFError,
    AttributeError,
    RecursionError,
    struct.error,
    zstandard.ZstdError,
)
_REMEDY = "run `toponav data verify` on the dataset, then `toponav data repair`"


@dataclass(frozen=True)
class StoredTrajectory:
    """A finished file.

    Attributes:
        path: Where it is.
        sha256: Hash of its bytes.
        size_bytes: How long it is.
        end: How the trajectory in it ended.
    """

    path: Path
    sha256: str
    size_bytes: int
    end: TrajectoryEnd


class TrajectoryWriter:
    """Records one trajectory; nothing is on disk until `finish`.

    Args:
        path: The file to write, ending in `.mcap`.
        metadata: How the trajectory comes about.

    Example:
        >>> writer = TrajectoryWriter(Path("000000.mcap"), metadata)
        >>> writer.append(depth_m, pose, velocity, command, executed)
        >>> stored = writer.finish("success")
    """

    def __init__(self, path: Path, metadata: TrajectoryMetadata) -> None:
        self._path = path
        self._metadata = metadata
        camera = metadata.camera
        self._period_ns = round(metadata.period_s * 1e9)
        self._buffer = io.BytesIO()
        self._writer = Writer(self._buffer, enable_data_crcs=True)
        self._writer.start(profile="ros2", library="toponav")
        self._channels = self._register()
        self._image, self._odometry = ImageCodec(camera.width, camera.height), OdometryCodec()
        self._extra = {
            name: ImageCodec(camera.width, camera.height, EXTRA_ENCODINGS[name])
            for name in metadata.images
        }
        self._twist = TwistCodec()
        self._scaled = np.empty((camera.height, camera.width), np.float32)
        self.frames = 0
        self._distance_m = 0.0
        self._last: Pose2 | None = None
        self._add(METADATA_TOPIC, 0, text_message(metadata.to_json()))
        self._add(CAMERA_TOPIC, 0, camera_info(camera))

    def _register(self) -> dict[str, int]:
        schemas = {
            name: self._writer.register_schema(name, "ros2msg", definition_of(name))
            for name in dict.fromkeys(_TOPICS.values())
        }
        return {
            topic: self._writer.register_channel(topic, "cdr", schemas[name])
            for topic, name in _TOPICS.items()
        } | {
            EXTRA_TOPICS[name]: self._writer.register_channel(
                EXTRA_TOPICS[name], "cdr", schemas[ImageCodec.TYPE]
            )
            for name in self._metadata.images
        }

    def _add(self, topic: str, time_ns: int, message: bytes) -> None:
        self._writer.add_message(self._channels[topic], time_ns, message, time_ns, self.frames)

    def append(
        self,
        depth_m: Float32[np.ndarray, "height width"],
        pose: Pose2,
        velocity: Velocity,
        command: Velocity,
        executed: Velocity,
        images: Mapping[ExtraImage, np.ndarray] = MappingProxyType({}),
    ) -> None:
        """Add a frame: what was seen where, what to do there, and what was done.

        Args:
            depth_m: Z-depth; whole millimetres of it are kept.
            pose: The true pose.
            velocity: The measured velocity.
            command: What the expert would do here.
            executed: What the robot was told.
            images: Each of the images that the metadata names.
        """
        assert images.keys() == self._extra.keys(), (list(images), list(self._extra))
        time_ns = self.frames * self._period_ns
        np.multiply(depth_m, np.float32(1000.0), out=self._scaled)
        self._scaled += np.float32(0.5)
        image = self._image.pack(self._scaled.astype(np.uint16), time_ns)
        self._add(DEPTH_TOPIC, time_ns, image)
        for name, codec in self._extra.items():
            self._add(EXTRA_TOPICS[name], time_ns, codec.pack(images[name], time_ns))
        self._add(ODOMETRY_TOPIC, time_ns, self._odometry.pack(pose, velocity, time_ns))
        self._add(COMMAND_TOPIC, time_ns, self._twist.pack(command, time_ns))
        self._add(EXECUTED_TOPIC, time_ns, self._twist.pack(executed, time_ns))
        if self._last is not None:
            self._distance_m += pose.distance_to(self._last)
        self._last = pose
        self.frames += 1

    def finish(self, outcome: str, contact: str = "") -> StoredTrajectory:
        """Write the file: complete, flushed, under its final name."""
        end = TrajectoryEnd(outcome, self.frames, contact, round(self._distance_m, 4))
        time_ns = max(self.frames - 1, 0) * self._period_ns
        self._add(END_TOPIC, time_ns, text_message(end.to_json()))
        self._writer.add_metadata(
            _RECORD, {"trajectory": self._metadata.to_json(), "end": end.to_json()}
        )
        self._writer.finish()  # type: ignore[no-untyped-call]
        content = self._buffer.getvalue()
        write_atomically(self._path, content)
        digest = hashlib.sha256(content).hexdigest()
        return StoredTrajectory(self._path, digest, len(content), end)


def _opened(path: Path) -> bytes:
    try:
        return read_bytes(path, max_bytes=_MAX_BAG_BYTES)
    except InputError as error:
        raise InputError(error.rule, where=error.where, remedy=_REMEDY) from None


def _broken(path: Path, error: Exception) -> InputError:
    detail = (str(error) or type(error).__name__)[:300]
    return InputError(f"the bag must be whole, got: {detail}", where=str(path), remedy=_REMEDY)


def read_summary(path: Path) -> tuple[TrajectoryMetadata, TrajectoryEnd, str, int]:
    """Metadata, end, SHA-256 and size of a trajectory, without unpacking its frames.

    Raises:
        InputError: The file is missing or not a complete bag of this package.
    """
    content = _opened(path)
    try:
        metadata, end = _summary(content)
    except _UNREADABLE as error:
        raise _broken(path, error) from error
    return metadata, end, hashlib.sha256(content).hexdigest(), len(content)


def _summary(content: bytes) -> tuple[TrajectoryMetadata, TrajectoryEnd]:
    for record in SeekingReader(io.BytesIO(content)).iter_metadata():
        if record.name == _RECORD:
            metadata = TrajectoryMetadata.from_json(record.metadata["trajectory"])
            return metadata, TrajectoryEnd.from_json(record.metadata["end"])
    raise ValueError("it has no record named 'toponav'")


def _messages(content: bytes, validate: bool) -> Iterator[tuple[str, int, memoryview]]:
    """Topic, time in nanoseconds and bytes of each message, in the order of the file."""
    topics: dict[int, str] = {}
    stream = StreamReader(io.BytesIO(content), emit_chunks=True, validate_crcs=validate)
    for record in stream.records:
        if not isinstance(record, Chunk):
            continue
        unpacked = _unpacked(record)
        if validate and zlib.crc32(unpacked) != record.uncompressed_crc:
            raise ValueError(f"the checksum of a chunk of {len(record.data)} bytes differs")
        view, at = memoryview(unpacked), 0
        while at < len(view):
            opcode, length = struct.unpack_from("<BQ", view, at)
            at += 9
            if opcode == _MESSAGE_OPCODE:
                channel, _, time_ns, _ = struct.unpack_from("<HIQQ", view, at)
                yield topics[channel], time_ns, view[at + 22 : at + length]
            elif opcode == 4:
                channel, name = _channel_at(view, at)
                topics[channel] = name
            at += length


def _unpacked(chunk: Chunk) -> bytes:
    """A chunk's messages, after a look at how much memory they would take."""
    if chunk.compression != "zstd":
        raise ValueError(f"its chunks must be packed with zstd, got {chunk.compression[:20]!r}")
    size = zstandard.get_frame_parameters(chunk.data).content_size
    if size != chunk.uncompressed_size or size > _MAX_CHUNK_BYTES:
        raise ValueError(f"a chunk says that it unpacks to {size:,} bytes")
    return zstandard.decompress(chunk.data, size)


def _channel_at(view: memoryview, at: int) -> tuple[int, str]:
    channel, _, length = struct.unpack_from("<HHI", view, at)
    return channel, bytes(view[at + 8 : at + 8 + length]).decode()


def read_trajectory(
    path: Path,
    *,
    depth: bool = True,
    rgb: bool = False,
    semantic: bool = False,
    validate: bool = False,
) -> Recording:
    """The trajectory in a bag, as arrays.

    Args:
        path: An `.mcap` file written by `TrajectoryWriter`.
        depth: Whether to keep the depth images; without them `depth_mm` is empty.
        rgb: Whether to keep the colour images.
        semantic: Whether to keep the images of classes.
        validate: Whether to check every CRC.

    Raises:
        InputError: The file is missing, cut, altered or lacks a topic, or was recorded without
            the images that are asked for.

    Example:
        >>> path = Path("data/trajectories/000000.mcap")
        >>> recording = read_trajectory(path, rgb=True)  # doctest: +SKIP
    """
    content = _opened(path)
    asked = {"depth": depth, "rgb": rgb, "semantic": semantic}
    try:
        return _parse(path, content, {name for name, is_on in asked.items() if is_on}, validate)
    except InputError:
        raise
    except _UNREADABLE as error:
        raise _broken(path, error) from error


def depth_images(path: Path) -> Iterator[UInt16[np.ndarray, "rows cols"]]:
    """The images of a trajectory in millimetres, one by one; each is valid until the next.

    Raises:
        InputError: The file is missing or broken.
    """
    content = _opened(path)
    try:
        for topic, _, message in _messages(content, validate=False):
            if topic == DEPTH_TOPIC:
                yield ImageCodec.unpack(message)
    except _UNREADABLE as error:
        raise _broken(path, error) from error


def _parse(path: Path, content: bytes, wanted: set[str], validate: bool) -> Recording:
    metadata, end = _summary(content)
    images = image_readers(path, metadata, end.frames, wanted)
    rows: dict[str, list[tuple[float, ...]]] = {ODOMETRY_TOPIC: []}
    rows |= {COMMAND_TOPIC: [], EXECUTED_TOPIC: []}
    times_ns: list[int] = []
    for topic, time_ns, message in _messages(content, validate):
        if topic == ODOMETRY_TOPIC:
            rows[topic].append(OdometryCodec.unpack(message))
            times_ns.append(time_ns)
        elif topic in rows:
            rows[topic].append(TwistCodec.unpack(message))
        elif topic in images:
            images[topic].take(message)
    counts = {topic: one.seen for topic, one in images.items()}
    counts |= {topic: len(values) for topic, values in rows.items()}
    if set(counts.values()) != {end.frames}:
        raise ValueError(f"each topic must hold {end.frames} messages, got {counts}")
    odometry = np.array(rows[ODOMETRY_TOPIC], np.float64).reshape(-1, 5)
    commands = np.array(rows[COMMAND_TOPIC] + rows[EXECUTED_TOPIC], np.float64)
    for what, values in (("poses", odometry), ("commands", commands)):
        if not (np.abs(values) <= _LARGEST).all():  # NaN is not either
            raise ValueError(f"{what} must be finite numbers below {_LARGEST:g}")
    return Recording(
        metadata=metadata,
        end=end,
        time_s=np.array(times_ns, np.float64) / 1e9,
        depth_mm=images[DEPTH_TOPIC].kept,
        pose=np.ascontiguousarray(odometry[:, :3]),
        velocity=odometry[:, 3:].astype(np.float32),
        command=np.array(rows[COMMAND_TOPIC], np.float32).reshape(-1, 2),
        executed=np.array(rows[EXECUTED_TOPIC], np.float32).reshape(-1, 2),
        rgb=kept_images(images, EXTRA_TOPICS["rgb"], metadata.camera),
        semantic=kept_images(images, EXTRA_TOPICS["semantic"], metadata.camera),
    )


def _summary_crc(content: bytes) -> int:
    """The CRC-32 of all from the summary's start to the footer's own checksum, as MCAP has it."""
    start = int.from_bytes(content[-28:-20], "little")
    return zlib.crc32(memoryview(content)[start:-12])


def check_bag(path: Path) -> str:
    """What is wrong with a bag, or an empty string: structure, every CRC, every topic."""
    try:
        read_trajectory(path, depth=False, validate=True)
        content = _opened(path)
        if _summary_crc(content) != int.from_bytes(content[-12:-8], "little"):
            return "the checksum of its summary differs"
    except InputError as error:
        return error.rule
    return ""

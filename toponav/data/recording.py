"""What one trajectory holds: how it came about, and its frames as arrays."""

import dataclasses
import json
from dataclasses import dataclass, field
from typing import Literal, TypeVar

import numpy as np
from jaxtyping import Float32, Float64, UInt8, UInt16

from toponav.core.camera import PinholeCamera
from toponav.core.files import check_file_name, parse_json
from toponav.core.typed_json import from_json
from toponav.maps.plan import Plan

__all__ = ["ExtraImage", "Recording", "TrajectoryEnd", "TrajectoryMetadata"]

Parsed = TypeVar("Parsed")
ExtraImage = Literal["rgb", "semantic"]
"""What can be recorded besides depth."""


@dataclass(frozen=True)
class TrajectoryMetadata:
    """How a trajectory came about: enough to record it again.

    Attributes:
        index: Number of the trajectory in its dataset.
        dataset_seed: Seed of the dataset; with `index` it determines the trajectory.
        building: Name of the folder under `buildings/` that holds its scene and map.
        scene_hash: Content hash of the scene.
        map_hash: SHA-256 of the map file.
        plan: The plan that was driven.
        camera: The depth camera.
        period_s: Time between frames.
        source: Who drove, such as `expert` or `dagger-1`.
        noise_scale: Factor on the noise of equation 3 that this trajectory was driven with.
        attempt: How many earlier attempts missed the goal.
        images: What was recorded besides depth.
    """

    index: int
    dataset_seed: int
    building: str
    scene_hash: str
    map_hash: str
    plan: Plan
    camera: PinholeCamera = field(default_factory=PinholeCamera)
    period_s: float = 0.2
    source: str = "expert"
    noise_scale: float = 1.0
    attempt: int = 0
    images: tuple[ExtraImage, ...] = ()

    def to_json(self) -> str:
        """The metadata as JSON text, the same text for the same metadata."""
        content = dataclasses.asdict(self)
        if not self.images:  # as before there were any
            del content["images"]
        plan = {"nodes": list(self.plan.nodes), "edges": list(self.plan.edges)}
        return json.dumps({"schema": 1, **content, "plan": plan}, sort_keys=True)

    @staticmethod
    def from_json(text: str) -> "TrajectoryMetadata":
        """The metadata written by `to_json`.

        Raises:
            ValueError: The text is not such metadata.
        """
        metadata = _parsed(TrajectoryMetadata, text)
        check_file_name(metadata.building, "trajectory metadata, building")
        if metadata.index < 0 or not metadata.plan.nodes:
            raise ValueError("a trajectory has a number from 0 and a plan")
        return metadata


@dataclass(frozen=True)
class TrajectoryEnd:
    """How a trajectory ended.

    Attributes:
        outcome: `success`, `collided`, `stuck` or `timeout`.
        frames: How many frames were recorded.
        contact: What the robot touched, or an empty string.
        distance_m: Distance driven.
    """

    outcome: str
    frames: int
    contact: str = ""
    distance_m: float = 0.0

    def to_json(self) -> str:
        """The end as JSON text."""
        return json.dumps({"schema": 1, **dataclasses.asdict(self)}, sort_keys=True)

    @staticmethod
    def from_json(text: str) -> "TrajectoryEnd":
        """The end written by `to_json`.

        Raises:
            ValueError: The text is not such an end.
        """
        return _parsed(TrajectoryEnd, text)


def _parsed(wanted: type[Parsed], text: str) -> Parsed:
    """The dataclass that its `to_json` wrote."""
    where = f"{wanted.__name__} in the bag"
    content = parse_json(text.encode(), where)
    if not isinstance(content, dict) or content.pop("schema", None) != 1:
        raise ValueError("trajectory metadata must have schema 1")
    return from_json(wanted, content, where=where)


@dataclass(frozen=True)
class Recording:
    """One trajectory as arrays, a row a frame; a frame's command acts until the next frame.

    Attributes:
        metadata: How it came about.
        end: How it ended.
        time_s: Seconds since the start.
        depth_mm: Z-depth in millimetres, 0 where nothing was seen; empty if not read.
        pose: True x, y (metres) and yaw (radians) in the map's frame.
        velocity: Measured linear (m/s) and angular (rad/s) velocity.
        command: What the expert would do here: the label.
        executed: What the robot was told: the command with noise, or an agent's own.
        rgb: Colour images; empty if not recorded or not read.
        semantic: `SemanticClass` of what each pixel shows, 255 for nothing; likewise.
    """

    metadata: TrajectoryMetadata
    end: TrajectoryEnd
    time_s: Float64[np.ndarray, " frames"]
    depth_mm: UInt16[np.ndarray, "images rows cols"]
    pose: Float64[np.ndarray, "frames 3"]
    velocity: Float32[np.ndarray, "frames 2"]
    command: Float32[np.ndarray, "frames 2"]
    executed: Float32[np.ndarray, "frames 2"]
    rgb: UInt8[np.ndarray, "colors rows cols 3"]
    semantic: UInt8[np.ndarray, "labels rows cols"]

    def __len__(self) -> int:
        return len(self.time_s)

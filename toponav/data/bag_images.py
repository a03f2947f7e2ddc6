"""The images of a bag: on which topics they are, and reading those that are wanted."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np

from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.data.messages import ImageCodec
from toponav.data.recording import ExtraImage, TrajectoryMetadata

__all__ = [
    "DEPTH_TOPIC",
    "EXTRA_ENCODINGS",
    "EXTRA_TOPICS",
    "ImageReader",
    "image_readers",
    "kept_images",
]

DEPTH_TOPIC: Final = "/camera/depth/image_raw"
EXTRA_TOPICS: Final[dict[ExtraImage, str]] = {
    "rgb": "/camera/color/image_raw",
    "semantic": "/camera/semantic/image_raw",
}
"""Images that are recorded on request; one cast sees them and depth."""
EXTRA_ENCODINGS: Final[dict[ExtraImage, str]] = {"rgb": "rgb8", "semantic": "mono8"}
"""How their pixels are stored."""


class ImageReader:
    """Images of one topic as they are read: checked, counted, and kept where they are wanted."""

    def __init__(self, encoding: str, camera: PinholeCamera, count: int) -> None:
        colors = (3,) if encoding == "rgb8" else ()
        self._encoding = encoding
        self.kept = np.empty(
            (count, camera.height, camera.width, *colors),
            np.uint16 if encoding == "16UC1" else np.uint8,
        )
        self.seen = 0

    def take(self, message: memoryview) -> None:
        """The next image.

        Raises:
            ValueError: It is of another size or kind.
        """
        image = ImageCodec.unpack(message, self._encoding)
        if image.shape != self.kept.shape[1:]:
            size = "x".join(map(str, image.shape))
            raise ValueError(f"image {self.seen} must be of the camera's size, got {size}")
        if len(self.kept):
            self.kept[self.seen] = image
        self.seen += 1


def image_readers(
    path: Path, metadata: TrajectoryMetadata, frames: int, wanted: set[str]
) -> dict[str, ImageReader]:
    """Where the images of each topic of a bag go, by topic."""
    missing = sorted(wanted - {"depth", *metadata.images})
    if missing:
        raise InputError(
            f"the trajectory was recorded without {', '.join(missing)}",
            where=str(path),
            remedy=f"collect it with --{missing[0]}",
        )
    readers = {
        DEPTH_TOPIC: ImageReader("16UC1", metadata.camera, frames if "depth" in wanted else 0)
    }
    for name in metadata.images:
        count = frames if name in wanted else 0
        readers[EXTRA_TOPICS[name]] = ImageReader(EXTRA_ENCODINGS[name], metadata.camera, count)
    return readers


def kept_images(
    images: Mapping[str, ImageReader], topic: str, camera: PinholeCamera
) -> np.ndarray:
    """The images of a topic; none of the camera's size where it was not recorded."""
    encoding = "rgb8" if topic == EXTRA_TOPICS["rgb"] else "mono8"
    return images[topic].kept if topic in images else ImageReader(encoding, camera, 0).kept

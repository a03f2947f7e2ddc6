"""Sizes of the networks of Neural Topological SLAM."""

from dataclasses import dataclass
from typing import Literal

from toponav.core.errors import InputError
from toponav.core.imagenav import DIRECTIONS
from toponav.core.vocabulary import RoomKind

__all__ = ["ROOM_KINDS", "NTSConfig", "NTSPresetName", "get_nts_preset"]

ROOM_KINDS = (
    RoomKind.HALLWAY,
    RoomKind.LIVING_ROOM,
    RoomKind.KITCHEN,
    RoomKind.DINING_ROOM,
    RoomKind.BEDROOM,
    RoomKind.BATHROOM,
    RoomKind.STUDY,
    RoomKind.STORAGE,
)
"""Kinds of rooms that the network tells apart."""

NTSPresetName = Literal["compact", "paper"]


@dataclass(frozen=True)
class NTSConfig:
    """The one multi-task network (section 4.2)."""

    rows: int = 32
    """Rows of the panorama that the network sees."""
    cols: int = 144
    """Columns of it: equal angles, from forward to the left."""
    depth: bool = False
    """Whether it sees depth besides colour."""
    encoder: Literal["around", "resnet18"] = "around"
    """`around`: small, wrapped at the seam, and equally good in all directions, so that a turned
    panorama gives turned features. `resnet18`: the paper's."""
    width: int = 32
    """Channels of the first layers of `around`."""
    features: int = 64
    """Features of each direction."""
    matches: int = 4
    """Ways in which directions of two panoramas are compared (`around`)."""
    hidden: int = 96
    """Width of the fully connected layers."""
    dropout: float = 0.1
    ranges: int = 72
    """Directions in which the ranges to obstacles and walls are predicted."""

    def __post_init__(self) -> None:
        stride = 32 if self.encoder == "resnet18" else 4
        checks = {
            "rows": 32 <= self.rows <= 1024 and self.rows % 16 == 0,
            "cols": 32 <= self.cols <= 4096 and self.cols % stride == 0,
            "width": 1 <= self.width <= 1024,
            "features": 1 <= self.features <= 4096,
            "matches": 1 <= self.matches <= 256,
            "hidden": 1 <= self.hidden <= 8192,
            "dropout": 0.0 <= self.dropout < 1.0,
            "ranges": 1 <= self.ranges <= 4096,
        }
        if self.encoder == "around":
            azimuths = self.azimuths
            checks["cols"] = checks["cols"] and azimuths % DIRECTIONS == 0 and azimuths % 4 == 0
            checks["ranges"] = checks["ranges"] and self.ranges % azimuths == 0
            checks["features"] = checks["features"] and self.features % self.matches == 0
        for name, holds in checks.items():
            if not holds:
                raise InputError(
                    f"{name} does not fit the others, got {getattr(self, name)}",
                    where="NTSConfig",
                    remedy="start from get_nts_preset('compact', depth=True)",
                )

    @property
    def channels(self) -> int:
        """Channels of the panorama that the network sees."""
        return 4 if self.depth else 3

    @property
    def azimuths(self) -> int:
        """Directions that the encoder tells apart."""
        return self.cols // (32 if self.encoder == "resnet18" else 4)


def get_nts_preset(name: NTSPresetName, *, depth: bool) -> NTSConfig:
    """The sizes that a name stands for.

    Args:
        name: `compact`, which trains in minutes on one CPU core, or `paper`: ResNet-18 on
            128x512 panoramas.
        depth: Whether the network sees depth besides colour.

    Raises:
        InputError: There is no such preset.
    """
    if name == "compact":
        # Without depth, how far things are shows in where they stand on the floor: more rows.
        return NTSConfig(depth=depth, rows=32 if depth else 64)
    if name == "paper":
        return NTSConfig(
            rows=128, cols=512, depth=depth, encoder="resnet18", hidden=512, dropout=0.5
        )
    raise InputError(
        f"there is no preset {name!r}", where="--preset", remedy="give compact or paper"
    )

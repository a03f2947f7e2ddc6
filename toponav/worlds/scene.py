"""What exists: a building's solid space, rooms, doors and where they came from."""

import hashlib
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Float32, Int16, UInt8

from toponav.core.errors import InputError, did_you_mean
from toponav.core.vocabulary import RoomKind
from toponav.worlds.grid import GridFrame, SemanticClass
from toponav.worlds.layout import HallwayLayout
from toponav.worlds.materials import Attribution, Material
from toponav.worlds.mesh import SceneMesh

__all__ = [
    "Attribution",
    "Door",
    "GridFrame",
    "Material",
    "Provenance",
    "Room",
    "Scene",
    "SceneMesh",
    "SemanticClass",
    "scene_from_heights",
]

_MAX_CEILING_M = 100.0


@dataclass(frozen=True, eq=False)
class Room:
    """A named place; its cells are those of `Scene.room_index` that hold its position.

    Attributes:
        name: Exact name, unique in the scene.
        kind: What it is used for.
        polygon_m: Outline, counter-clockwise, or None where only cells are known.
    """

    name: str
    kind: RoomKind
    polygon_m: Float[np.ndarray, "corners 2"] | None = None


@dataclass(frozen=True, eq=False)
class Door:
    """An opening between two rooms.

    Attributes:
        name: Exact name, unique in the scene.
        segment_m: The two jambs.
        width_m: Free width between the jambs with the leaf fully open.
        rooms: Names of the rooms on either side.
        open_fraction: 0 closed, 1 fully open.
    """

    name: str
    segment_m: Float[np.ndarray, "2 2"]
    width_m: float
    rooms: tuple[str, str]
    open_fraction: float = 1.0


@dataclass(frozen=True)
class Provenance:
    """Where a scene came from.

    Attributes:
        generator: Program that made it, such as `office` or `stanford`.
        version: Version of that program; the same version and seed make the same scene.
        seed: Seed of its random choices, where it made any.
        source: Name (never the path) of the file it was read from, or an empty string.
    """

    generator: str
    version: str = "1"
    seed: int | None = None
    source: str = ""


@dataclass(frozen=True, eq=False)
class Scene:
    """A building; immutable, arrays are read-only.

    Attributes:
        name: Name for display and files.
        grid: Where the cells lie.
        heights_m: 0 is floor; h is solid from the floor to h.
        ceiling_m: Height of the ceiling; no cell is higher.
        room_index: Index into `rooms` per cell; -1 is nowhere.
        rooms: Named places.
        doors: Openings between them, where they are known.
        semantics: `SemanticClass` of the obstacle in each cell.
        provenance: Where the scene came from.
        layout: The generator's hallways and doorways (`HallwayLayout`), else None.
        imported_mesh: The scanned mesh, where the scene is not an extruded plan.
        attribution: Whose furniture and meshes it holds, where their authors are known.
    """

    name: str
    grid: GridFrame
    heights_m: Float32[np.ndarray, "rows cols"]
    ceiling_m: float
    room_index: Int16[np.ndarray, "rows cols"]
    rooms: tuple[Room, ...]
    doors: tuple[Door, ...]
    semantics: UInt8[np.ndarray, "rows cols"]
    provenance: Provenance
    layout: HallwayLayout | None = None
    imported_mesh: SceneMesh | None = None
    attribution: tuple[Attribution, ...] = ()

    def __post_init__(self) -> None:
        _check(self)
        for array in (self.heights_m, self.room_index, self.semantics):
            array.setflags(write=False)

    @property
    def is_extruded(self) -> bool:
        """Whether the heights describe the whole building, so that fast renderers are exact."""
        return self.imported_mesh is None

    @cached_property
    def occupied(self) -> Bool[np.ndarray, "rows cols"]:
        """Cells that hold anything but floor."""
        occupied = self.heights_m > 0
        occupied.setflags(write=False)
        return occupied

    @cached_property
    def mesh(self) -> SceneMesh:
        """The imported mesh, or the heights extruded (made on first use)."""
        if self.imported_mesh is not None:
            return self.imported_mesh
        from toponav.worlds.extrude import extrude

        return extrude(self.grid, self.heights_m, self.semantics, self.ceiling_m)

    @cached_property
    def content_hash(self) -> str:
        """SHA-256 of everything that the scene holds, equal on every machine."""
        from toponav.worlds._scene_json import scene_metadata

        digest = hashlib.sha256(json.dumps(scene_metadata(self), sort_keys=True).encode())
        # Adding zero turns -0.0 into 0.0: equal scenes have equal bytes.
        digest.update((self.heights_m + np.float32(0)).astype("<f4").tobytes())
        digest.update(self.room_index.astype("<i2").tobytes())
        digest.update(self.semantics.astype("u1").tobytes())
        if self.imported_mesh is not None:
            digest.update(self.imported_mesh.digest())
        return digest.hexdigest()

    def room_at(self, x_m: float, y_m: float) -> str | None:
        """The name of the room at a point, or None where there is none."""
        row, col = self.grid.cell_of(x_m, y_m)
        if not (0 <= row < self.grid.rows and 0 <= col < self.grid.cols):
            return None
        index = int(self.room_index[row, col])
        return self.rooms[index].name if index >= 0 else None

    def room(self, name: str) -> Room:
        """The room of this exact name.

        Raises:
            InputError: When there is none; the message names the nearest.
        """
        return self.rooms[self.room_number(name)]

    def room_number(self, name: str) -> int:
        """The value of `room_index` in the room of this exact name.

        Raises:
            InputError: When there is none; the message names the nearest.
        """
        if name not in self._number_of_room:
            raise InputError(
                f"no room is called '{name}'",
                where=f"scene {self.name}",
                remedy=did_you_mean(name, self._number_of_room),
            )
        return self._number_of_room[name]

    @cached_property
    def _number_of_room(self) -> dict[str, int]:
        return {room.name: number for number, room in enumerate(self.rooms)}


def scene_from_heights(
    name: str,
    grid: GridFrame,
    heights_m: Float[np.ndarray, "rows cols"],
    *,
    ceiling_m: float = 2.7,
    room_index: np.ndarray | None = None,
    rooms: Sequence[Room] = (),
    doors: Sequence[Door] = (),
    semantics: np.ndarray | None = None,
    provenance: Provenance | None = None,
    layout: HallwayLayout | None = None,
) -> Scene:
    """An extruded scene; what is not given is derived from the heights.

    Args:
        name: Name for display and files.
        grid: Where the cells lie.
        heights_m: 0 is floor; h is solid from the floor to h; at or above the ceiling is wall.
        ceiling_m: Height of the ceiling.
        room_index: Index into `rooms` per cell, -1 nowhere; default nowhere.
        rooms: Named places.
        doors: Openings between them.
        semantics: `SemanticClass` per cell; default wall to the ceiling, else furniture.
        provenance: Where it came from; default `heights`.
        layout: A generator's `HallwayLayout`.

    Raises:
        InputError: When arrays and grid disagree, or a height is not finite.
    """
    heights = np.minimum(np.array(heights_m, dtype=np.float32), np.float32(ceiling_m))
    if semantics is None:
        low = np.where(heights > 0, SemanticClass.FURNITURE, SemanticClass.FLOOR)
        semantics = np.where(heights >= np.float32(ceiling_m), SemanticClass.WALL, low)
    if room_index is None:
        room_index = np.full(heights.shape, -1)
    return Scene(
        name=name,
        grid=grid,
        heights_m=heights,
        ceiling_m=float(ceiling_m),
        room_index=np.array(room_index, dtype=np.int16),
        rooms=tuple(rooms),
        doors=tuple(doors),
        semantics=np.array(semantics, dtype=np.uint8),
        provenance=provenance or Provenance("heights"),
        layout=layout,
    )


def _check(scene: Scene) -> None:
    """Raises InputError for the first thing that does not fit together."""

    def require(holds: bool, rule: str, remedy: str) -> None:
        if not holds:
            raise InputError(rule, where=f"scene {scene.name}", remedy=remedy)

    for field in ("heights_m", "room_index", "semantics"):
        shape = getattr(scene, field).shape
        require(
            shape == scene.grid.shape,
            f"{field} must cover the grid of {scene.grid.shape} cells, got {shape}",
            "give every array one value per cell",
        )
    require(
        0.1 <= scene.ceiling_m <= _MAX_CEILING_M,
        f"ceiling_m must lie in 0.1..{_MAX_CEILING_M:g}, got {scene.ceiling_m}",
        "give the ceiling in metres",
    )
    good = (scene.heights_m >= 0) & (scene.heights_m <= np.float32(scene.ceiling_m))
    if not good.all():
        row, col = np.argwhere(~good)[0].tolist()
        value = scene.heights_m[row, col]
        require(
            False,
            f"heights must lie between floor and ceiling, got {value} in cell ({row}, {col})",
            "give heights in metres, 0 for floor",
        )
    lowest, highest = int(scene.room_index.min()), int(scene.room_index.max())
    require(
        lowest >= -1 and highest < len(scene.rooms),
        f"room_index must lie in -1..{len(scene.rooms) - 1}, got {lowest}..{highest}",
        "number the rooms from 0 and use -1 for nowhere",
    )
    require(
        int(scene.semantics.max()) <= max(SemanticClass),
        f"semantics must be SemanticClass values, got {int(scene.semantics.max())}",
        f"use 0..{int(max(SemanticClass))}",
    )
    for what, names in (
        ("room", [room.name for room in scene.rooms]),
        ("door", [door.name for door in scene.doors]),
    ):
        double = sorted(name for name, count in Counter(names).items() if count > 1)[:5]
        require(not double, f"{what} names must be unique, got {double} twice", "rename one")
        strange = [name for name in (scene.name, *names) if not name.isprintable()]
        require(not strange, f"names must be printable, got {strange[:1]}", "rename it")

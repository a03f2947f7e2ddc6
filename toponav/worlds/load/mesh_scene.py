"""A scene from triangles: floor, ceiling, what a robot would hit, rooms and doors."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float32, Int16, Int32, UInt8

from toponav.core.errors import InputError
from toponav.core.vocabulary import RoomKind
from toponav.worlds.furniture_names import furniture_class, semantic_of_name
from toponav.worlds.grid import GridFrame, SemanticClass
from toponav.worlds.load._mesh_cells import (
    ceiling_over,
    classify_faces,
    floor_bounds,
    obstacle_heights,
    open_floor,
)
from toponav.worlds.load._mesh_rooms import rooms_from_labels, rooms_from_walls
from toponav.worlds.load.levels import Columns, columns_over, find_floor_m
from toponav.worlds.load.mesh_parts import MeshPart, Notes, clean_part, join_parts
from toponav.worlds.materials import Attribution
from toponav.worlds.mesh import SceneMesh
from toponav.worlds.scene import Door, Provenance, Room, Scene
from toponav.worlds.simplify import simplify_mesh

__all__ = ["MeshOptions", "RoomLabels", "scene_of_parts"]

_LEAST_M, _MOST_M = 1.0, 500.0


@runtime_checkable
class RoomLabels(Protocol):
    """Rooms that a file names."""

    @property
    def rooms(self) -> Sequence[tuple[str, RoomKind]]:
        """Name and kind of each."""

    def cells(
        self,
        grid: GridFrame,
        vertices_m: Float32[np.ndarray, "vertices 3"],
        faces: Int32[np.ndarray, "faces 3"],
    ) -> Int16[np.ndarray, "rows cols"]:
        """The room of each cell; -1 nowhere."""


@dataclass(frozen=True)
class MeshOptions:
    """How triangles become a scene.

    Attributes:
        resolution_m: Side of a cell.
        floor_height_m: Take the level nearest to this height instead of the largest.
        max_faces: Scenes with more triangles are simplified.
    """

    resolution_m: float = 0.05
    floor_height_m: float | None = None
    max_faces: int = 2_000_000


def scene_of_parts(
    parts: Sequence[MeshPart],
    *,
    name: str,
    provenance: Provenance,
    where: str,
    notes: Notes,
    options: MeshOptions | None = None,
    labels: RoomLabels | None = None,
    attribution: Sequence[Attribution] = (),
) -> Scene:
    """The scene of a building's triangles; its floor comes to lie at z = 0.

    Args:
        parts: Objects, in metres, z up.
        name: Name for display and files.
        provenance: Where it came from.
        where: The file, for messages.
        notes: Where repairs are written down.
        options: Grid, level and size.
        labels: Rooms that the file names; else they are cut from the free space.
        attribution: Whose work is in it.

    Raises:
        InputError: Nothing to stand on, or not of a building's size; the message says which.
    """
    options = options or MeshOptions()
    mesh, known, things = _joined(parts, where, notes)
    floor_m = _floor_m(mesh, known, where, options, notes)
    shifted = mesh.vertices_m - np.array([0.0, 0.0, floor_m], np.float32)
    mesh = replace(mesh, vertices_m=shifted)
    low, high = floor_bounds(mesh, where)
    extent_m = float(np.max(high - low))
    if not _LEAST_M <= extent_m <= _MOST_M:
        raise InputError(
            f"a level is {_LEAST_M:g}..{_MOST_M:g} m long, got {extent_m:.4g} m",
            where=where,
            remedy="give the unit of the file, such as --units cm",
        )
    columns = columns_over(mesh.vertices_m, mesh.faces, 0.0, low, high, options.resolution_m)
    return _assemble(
        mesh, known, things, columns, name, provenance, where, notes, options, labels, attribution
    )


def _assemble(
    mesh: SceneMesh,
    known: Bool[np.ndarray, " faces"],
    things: Sequence[tuple[str, tuple[float, float]]],
    columns: Columns,
    name: str,
    provenance: Provenance,
    where: str,
    notes: Notes,
    options: MeshOptions,
    labels: RoomLabels | None,
    attribution: Sequence[Attribution],
) -> Scene:
    """The scene of a mesh whose columns are known."""
    grid = columns.grid
    structure = _structure(mesh, known, columns)
    free, inside = open_floor(columns, structure, notes)
    if free.sum() * grid.resolution_m**2 < 0.5:
        raise InputError(
            "has no floor that a robot could stand on",
            where=where,
            remedy="check the axis that points up (--up), the unit (--units) and the level "
            "(--floor-height)",
        )
    ceiling_m = ceiling_over(columns, free, structure)
    rooms: tuple[Room, ...]
    doors: tuple[Door, ...]
    if labels is not None and len(labels.rooms):
        cells = labels.cells(grid, mesh.vertices_m, mesh.faces)
        rooms, doors, room_index = rooms_from_labels(labels.rooms, cells, free, grid)
    else:
        rooms, doors, room_index = rooms_from_walls(grid, structure, free, inside, things, notes)
    mesh = classify_faces(mesh, known, grid, structure, columns.blocked, ceiling_m)
    heights_m, semantics = obstacle_heights(columns, mesh, free, inside, ceiling_m)
    mesh = _cut_out(mesh, grid, ceiling_m, notes)
    if len(mesh.faces) > options.max_faces:
        before = len(mesh.faces)
        mesh = simplify_mesh(mesh, options.max_faces)
        notes.add(f"{before:,} triangles simplified to {len(mesh.faces):,}")
    return Scene(
        name=name,
        grid=grid,
        heights_m=heights_m,
        ceiling_m=ceiling_m,
        room_index=room_index,
        rooms=rooms,
        doors=doors,
        semantics=semantics,
        provenance=provenance,
        imported_mesh=mesh,
        attribution=tuple(attribution),
    )


def _joined(
    parts: Sequence[MeshPart], where: str, notes: Notes
) -> tuple[SceneMesh, Bool[np.ndarray, " faces"], list[tuple[str, tuple[float, float]]]]:
    """One mesh, which triangles' classes the file tells, and what furniture stands where."""
    cleaned = [clean_part(part, notes) for part in parts]
    cleaned = [part for part in cleaned if len(part.faces)]
    kinds = [
        part.semantic if part.semantic is not None else semantic_of_name(part.name)
        for part in cleaned
    ]
    mesh = join_parts(
        cleaned,
        [SemanticClass.FURNITURE if kind is None else kind for kind in kinds],
        where,
    )
    counts = [len(part.faces) for part in cleaned]
    things: dict[str, tuple[str, tuple[float, float]]] = {}
    for number, part in enumerate(cleaned):
        what = furniture_class(part.name)
        if what is not None:
            x_m, y_m, _ = part.vertices.mean(axis=0).tolist()
            things.setdefault(part.group or str(number), (what, (x_m, y_m)))
    known = np.repeat(np.array([kind is not None for kind in kinds]), counts)
    return mesh, known, list(things.values())


def _floor_m(
    mesh: SceneMesh,
    known: Bool[np.ndarray, " faces"],
    where: str,
    options: MeshOptions,
    notes: Notes,
) -> float:
    """The height of the level to take, in the file's frame."""
    floors = known & (mesh.face_semantic == SemanticClass.FLOOR)
    floor_m = find_floor_m(
        mesh.vertices_m,
        mesh.faces,
        where,
        floor_faces=mesh.faces[floors] if floors.any() else None,
        near_m=options.floor_height_m,
    )
    if abs(floor_m) > 0.01:
        notes.add(f"floor at {floor_m:.2f} m moved to z = 0")
    return floor_m


def _structure(
    mesh: SceneMesh, known: Bool[np.ndarray, " faces"], columns: Columns
) -> Bool[np.ndarray, "rows cols"]:
    """Cells of walls: what stands all the way up, and what the file calls a wall or window."""
    tall = columns.filled(0.6, 1.6) >= 0.8
    of_wall: UInt8[np.ndarray, " faces"] = np.isin(
        mesh.face_semantic,
        [SemanticClass.WALL, SemanticClass.WINDOW, SemanticClass.COLUMN],
    ).astype(np.uint8)
    called = np.append(of_wall & known, 0).astype(bool)[columns.owner]
    return np.asarray((tall & columns.blocked) | called)


def _cut_out(mesh: SceneMesh, grid: GridFrame, ceiling_m: float, notes: Notes) -> SceneMesh:
    """The mesh without other levels and without what lies beside the plan."""
    z = mesh.vertices_m[:, 2][mesh.faces]
    keep = (z.max(axis=1) > -0.3) & (z.min(axis=1) < ceiling_m + 0.3)
    left, right, bottom, top = grid.extent_m
    for axis, (low, high) in enumerate(((left, right), (bottom, top))):
        at = mesh.vertices_m[:, axis][mesh.faces]
        keep &= (at.max(axis=1) > low - 0.5) & (at.min(axis=1) < high + 0.5)
    if keep.all():
        return mesh
    notes.add("triangles of other levels or beside the building left out", int((~keep).sum()))
    faces = mesh.faces[keep]
    used, local = np.unique(faces, return_inverse=True)
    return SceneMesh(
        mesh.vertices_m[used],
        local.reshape(-1, 3).astype(np.int32),
        mesh.face_semantic[keep],
        mesh.face_instance[keep],
        mesh.face_material[keep],
        mesh.corner_uv[keep],
        mesh.materials,
    )

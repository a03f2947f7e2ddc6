"""A home under construction: triangles with their surfaces, and what a robot would hit."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float32, UInt8
from scipy import ndimage

from toponav.worlds.generate._home_shell import CELL_M, Shell
from toponav.worlds.generate.shapes import Shape, turned
from toponav.worlds.generate.surfaces import Surface
from toponav.worlds.grid import SemanticClass
from toponav.worlds.materials import Attribution, Material
from toponav.worlds.mesh import SceneMesh

__all__ = ["DRIVING_BAND_M", "Canvas", "Cells", "Piece", "footprint", "turned_exactly"]

DRIVING_BAND_M = (0.03, 1.3)
"""What lies between these heights blocks a robot, up to the top of its camera's mast."""

Cells = Bool[np.ndarray, "rows cols"]


@dataclass(frozen=True, eq=False)
class Piece:
    """Something to put down.

    Attributes:
        name: Furniture class.
        model: Identity of the model, `class/variant` or that of a library.
        semantic: What cameras report.
        shape: Its triangles.
        surfaces: What each of the shape's slots is made of, where that is not up to the home.
        attribution: Whose work it is, where it comes from a library.
    """

    name: str
    model: str
    semantic: SemanticClass
    shape: Shape
    surfaces: tuple[Surface, ...] | None = None
    attribution: Attribution | None = None


class Canvas:
    """Collects the mesh and the grid of a home.

    Attributes:
        shell: Walls and rooms.
        blocked: Cells that a robot cannot enter.
        heights_m: Height of the highest thing in each of them.
        semantics: Class of the obstacle per cell.
        models: Class and identity of each model put down, by instance.
    """

    def __init__(self, shell: Shell) -> None:
        self.shell = shell
        self.blocked: Cells = shell.wall.copy()
        ceiling = np.float32(shell.ceiling_m)
        self.heights_m: Float32[np.ndarray, "rows cols"] = np.where(
            shell.wall, ceiling, np.float32(0)
        ).astype(np.float32)
        self.semantics: UInt8[np.ndarray, "rows cols"] = np.where(
            shell.wall, SemanticClass.WALL, SemanticClass.FLOOR
        ).astype(np.uint8)
        self.models: dict[int, tuple[str, str]] = {}
        self._attribution: dict[Attribution, None] = {}
        self._instances = 0
        self._materials: list[Material] = []
        self._number_of: dict[int, int] = {}
        self._faces: list[tuple[np.ndarray, np.ndarray, np.ndarray, int, int]] = []

    @property
    def attribution(self) -> tuple[Attribution, ...]:
        """Whose models were put down, in the order of their first use."""
        return tuple(self._attribution)

    def new_instance(self) -> int:
        """A number for the next object."""
        self._instances += 1
        return self._instances - 1

    def add_shape(
        self,
        shape: Shape,
        surfaces: tuple[Surface, ...],
        semantic: SemanticClass,
        instance: int,
        matrix: np.ndarray | None = None,
        shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """Adds triangles, turned and then shifted; slots take the surfaces in order."""
        corners = shape.corners_m if matrix is None else shape.corners_m @ matrix.T
        scales = np.array([one.scale_m or 1.0 for one in surfaces])
        numbers = np.array([self._material(one.material) for one in surfaces])
        self._faces.append(
            (
                corners + np.array(shift),
                shape.corner_uv / scales[shape.slot][:, None, None],
                numbers[shape.slot],
                int(semantic),
                instance,
            )
        )

    def _material(self, material: Material) -> int:
        # Surfaces are cached, so equal ones are the same object.
        key = id(material)
        if key not in self._number_of:
            self._number_of[key] = len(self._materials)
            self._materials.append(material)
        return self._number_of[key]

    def put(
        self,
        piece: Piece,
        surfaces: tuple[Surface, ...],
        at: tuple[float, float, float],
        yaw_rad: float,
        cells: tuple[tuple[slice, slice], Cells] | None,
    ) -> int:
        """Adds a piece and blocks its cells; the instance that it became."""
        instance = self.new_instance()
        self.models[instance] = (piece.name, piece.model)
        if piece.attribution is not None:
            self._attribution[piece.attribution] = None
        self.add_shape(
            piece.shape, surfaces, piece.semantic, instance, turned_exactly(yaw_rad), at
        )
        if cells is not None:
            window, mask = cells
            top = min(at[2] + piece.shape.size_m[2], self.shell.ceiling_m - 0.01)
            taller = mask & (self.heights_m[window] < top)
            self.heights_m[window][taller] = np.float32(top)
            self.semantics[window][taller] = piece.semantic
            self.blocked[window] |= mask
        return instance

    def mesh(self) -> SceneMesh:
        """All triangles as one mesh; corners are rounded to a hundredth of a millimetre."""
        corners = np.concatenate([part[0] for part in self._faces])
        points = np.round(corners.reshape(-1, 3), 5).astype(np.float32)
        # Corners as whole numbers of 10 micrometres, packed into one: sorts faster than rows.
        steps = np.rint(points.astype(np.float64) * 1e5).astype(np.int64) + 100_000
        keys = (steps[:, 0] * 3_200_000 + steps[:, 1]) * 600_000 + steps[:, 2]
        _, first, index = np.unique(keys, return_index=True, return_inverse=True)
        counts = [len(part[0]) for part in self._faces]
        uv = np.round(np.concatenate([part[1] for part in self._faces]), 4)
        return SceneMesh(
            points[first],
            index.reshape(-1, 3).astype(np.int32),
            np.repeat([part[3] for part in self._faces], counts).astype(np.uint8),
            np.repeat([part[4] for part in self._faces], counts).astype(np.int32),
            np.concatenate([part[2] for part in self._faces]).astype(np.int32),
            uv.astype(np.float32),
            tuple(self._materials),
        )


def turned_exactly(yaw_rad: float) -> np.ndarray:
    """The turn about z, without rounding errors at right angles."""
    matrix = turned(yaw_rad)
    quarter = np.round(matrix)
    return quarter if np.abs(matrix - quarter).max() < 1e-9 else matrix


def footprint(
    shape: Shape, at: tuple[float, float, float], yaw_rad: float, shape_limit: tuple[int, int]
) -> tuple[tuple[slice, slice], Cells] | None:
    """The cells that a robot cannot enter; None where some lie off the grid.

    Returns:
        A window of the grid and the mask in it; empty where a robot passes over or under.
    """
    points = _samples(shape, round(at[2], 3))
    if len(points) == 0:
        return (slice(0, 0), slice(0, 0)), np.zeros((0, 0), dtype=bool)
    placed = points @ turned_exactly(yaw_rad)[:2, :2].T + np.array(at[:2])
    cells = np.floor(placed / CELL_M).astype(int)
    col0, row0 = cells.min(axis=0).tolist()
    col1, row1 = (cells.max(axis=0) + 1).tolist()
    if row0 < 0 or col0 < 0 or row1 > shape_limit[0] or col1 > shape_limit[1]:
        return None
    mask = np.zeros((row1 - row0, col1 - col0), dtype=bool)
    mask[cells[:, 1] - row0, cells[:, 0] - col0] = True
    return (slice(row0, row1), slice(col0, col1)), np.asarray(ndimage.binary_fill_holes(mask))


_STEPS = np.array([1, 2, 4, 8, 12, 16, 24, 32, 48, 64, 96, 128])


@lru_cache(maxsize=2048)
def _samples(shape: Shape, z_m: float) -> np.ndarray:
    """Where the surface lies in the driving band, as points in the plan four centimetres apart."""
    low, high = DRIVING_BAND_M[0] - z_m, DRIVING_BAND_M[1] - z_m
    corners = shape.corners_m
    z = corners[..., 2]
    corners = corners[(z.max(axis=1) > low) & (z.min(axis=1) < high)]
    if len(corners) == 0:
        return np.zeros((0, 2))
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    steps = _STEPS[np.minimum(np.searchsorted(_STEPS, edges / 0.04), len(_STEPS) - 1)]
    parts = []
    for count in np.unique(steps):
        i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
        keep = i + j <= count
        weights = np.stack([i[keep], j[keep], count - i[keep] - j[keep]], axis=1) / count
        some = corners[steps == count]
        parts.append(np.tensordot(weights, some, axes=(1, 1)).reshape(-1, 3))
    points = np.concatenate(parts)
    # Two millimetres in from its box: what only touches the next cell does not take it.
    bounds = shape.corners_m.reshape(-1, 3)[:, :2]
    points[:, :2] = np.clip(points[:, :2], bounds.min(axis=0) + 0.002, bounds.max(axis=0) - 0.002)
    points = points[(points[:, 2] > low) & (points[:, 2] < high), :2]
    # One point in each square of two centimetres is enough.
    square = np.floor(points / 0.02).astype(np.int64)
    _, first = np.unique(square[:, 0] * 100_003 + square[:, 1], return_index=True)
    return np.asarray(points[np.sort(first)])

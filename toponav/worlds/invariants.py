"""What holds in every building that a robot is to drive through."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage

from toponav.worlds.free_space import FreeSpace
from toponav.worlds.grid import SemanticClass
from toponav.worlds.scene import Door, Scene

__all__ = ["INVARIANTS", "Fault", "check_invariants", "unreachable_rooms"]

INVARIANTS: tuple[str, ...] = (
    "rooms_reachable",
    "doors_clear",
    "rooms_disjoint",
    "furniture_inside",
    "grid_matches_mesh",
    "watertight",
)
"""Names of the rules, in the order in which they are checked."""

_ROBOT_RADIUS_M = 0.18
_LEAST_DOOR_M = 0.7
_LEAST_FLOOR_M2 = 0.15
_LARGEST_PIECE = 0.8
_SHARED_M2 = 0.05
_THROUGH_M = 0.03
"""Furniture this deep in a wall goes through it."""


@dataclass(frozen=True)
class Fault:
    """One thing that does not hold.

    Attributes:
        rule: One of `INVARIANTS`.
        where: The room, door or object.
        what: What was found there.
    """

    rule: str
    where: str
    what: str


def check_invariants(scene: Scene, *, views: int = 6, rays: int = 4000) -> list[Fault]:
    """Everything that keeps a robot from using a building; empty for a good one.

    The rules: a robot 0.36 m wide gets from any room to any other; every door is at least 0.7 m
    wide and nothing stands in it; rooms share no floor and each is one piece; no furniture
    reaches through a wall or into a door; what the grid calls free holds no furniture; and no
    ray from free space leaves the building.

    Args:
        scene: The building.
        views: Number of places that rays are cast from.
        rays: Number of rays from each.

    Example:
        >>> from toponav.worlds.generate.home import generate_home
        >>> check_invariants(generate_home(1))
        []
    """
    return [
        *_unreachable(scene),
        *_narrow_doors(scene),
        *_shared_floor(scene),
        *_furniture_in_walls(scene),
        *_escaping_rays(scene, views, rays),
    ]


def unreachable_rooms(scene: Scene) -> dict[str, float]:
    """Rooms of whose floor the robot's centre reaches too little, and how much, in m2."""
    space = FreeSpace.of(scene, _ROBOT_RADIUS_M)
    home = space.component == 1
    cell_m2 = scene.grid.resolution_m**2
    areas_m2 = {
        room.name: float((home & (scene.room_index == number)).sum()) * cell_m2
        for number, room in enumerate(scene.rooms)
    }
    return {name: area_m2 for name, area_m2 in areas_m2.items() if area_m2 < _LEAST_FLOOR_M2}


def _unreachable(scene: Scene) -> list[Fault]:
    return [
        Fault("rooms_reachable", name, f"a robot 0.36 m wide reaches only {area_m2:.2f} m2 of it")
        for name, area_m2 in unreachable_rooms(scene).items()
    ]


def _narrow_doors(scene: Scene) -> list[Fault]:
    """Doors below 0.7 m, and doors with something in them."""
    faults = []
    for door in scene.doors:
        clear_m = _clear_width_m(scene, door)
        if min(door.width_m, clear_m) < _LEAST_DOOR_M - 1e-6:
            what = f"{door.width_m:.2f} m wide, {clear_m:.2f} m of it clear"
            faults.append(Fault("doors_clear", door.name, what))
    return faults


def _clear_width_m(scene: Scene, door: Door) -> float:
    """The longest stretch between the jambs, and one cell before and behind, that is free."""
    (x0, y0), (x1, y1) = door.segment_m.tolist()
    length = math.hypot(x1 - x0, y1 - y0)
    if length < 1e-6:
        return 0.0
    step_m = scene.grid.resolution_m / 4
    along = np.arange(step_m / 2, length, step_m)
    normal = np.array([-(y1 - y0), x1 - x0]) / length
    least = math.inf
    for off_m in (-scene.grid.resolution_m / 2, scene.grid.resolution_m / 2):
        points = door.segment_m[0] + np.outer(
            along / length, door.segment_m[1] - door.segment_m[0]
        )
        points = points + normal * off_m
        cells = np.floor((points - np.array(scene.grid.origin_m)) / scene.grid.resolution_m)
        cols, rows = cells.astype(int).T
        inside = (rows >= 0) & (cols >= 0) & (rows < scene.grid.rows) & (cols < scene.grid.cols)
        free = np.zeros(len(along), bool)
        free[inside] = ~scene.occupied[rows[inside], cols[inside]]
        edges = np.flatnonzero(np.diff(free.astype(np.int8), prepend=0, append=0))
        longest = max((edges[1::2] - edges[::2]).tolist(), default=0) * step_m
        least = min(least, longest)
    return round(least, 3)


def _shared_floor(scene: Scene) -> list[Fault]:
    """Rooms without floor, rooms in several pieces, and outlines that overlap.

    A cell holds one room number, so cells cannot be shared. Hallways cross each other, which
    may cut one in two; only actual rooms must be one piece and have outlines of their own.
    """
    faults = []
    for number, room in enumerate(scene.rooms):
        mask = scene.room_index == number
        if not mask.any():
            faults.append(Fault("rooms_disjoint", room.name, "it has no floor"))
            continue
        sizes = np.bincount(ndimage.label(mask, np.ones((3, 3)))[0].ravel())[1:]
        share = float(sizes.max() / sizes.sum())
        if room.kind.is_enclosed and share < _LARGEST_PIECE:
            what = f"its floor is in {len(sizes)} pieces, the largest {share:.0%}"
            faults.append(Fault("rooms_disjoint", room.name, what))
    return faults + _shared_outlines(scene)


def _shared_outlines(scene: Scene) -> list[Fault]:
    """Pairs of actual rooms whose outlines overlap."""
    from shapely.geometry import Polygon

    outlines = [
        (room.name, Polygon(room.polygon_m))
        for room in scene.rooms
        if room.polygon_m is not None and room.kind.is_enclosed
    ]
    faults = []
    for number, (name, outline) in enumerate(outlines):
        for other, second in outlines[number + 1 :]:
            shared_m2 = outline.intersection(second).area
            if shared_m2 > _SHARED_M2:
                faults.append(Fault("rooms_disjoint", name, f"{shared_m2:.2f} m2 lie in {other}"))
    return faults


def _furniture_in_walls(scene: Scene) -> list[Fault]:
    """Objects that reach into walls or doors, and objects on floor that the grid calls free."""
    if scene.is_extruded:
        # One class a cell: furniture and wall cannot share one; only doors can be blocked.
        return []
    mesh = scene.mesh
    movable = mesh.face_semantic > SemanticClass.WINDOW
    points, owners = _points_on(mesh.vertices_m[mesh.faces[movable]], mesh.face_instance[movable])
    points, owners = points[points[:, 2] > 0.03], owners[points[:, 2] > 0.03]
    cells = _cells(scene, points)
    faults = []

    def report(rule: str, bad: np.ndarray, what: str) -> None:
        for instance in np.unique(owners[bad]).tolist():
            faults.append(Fault(rule, f"object {instance}", what))

    report("furniture_inside", _deep_in_walls(scene, points), "it reaches into a wall")
    rooms = scene.room_index[cells].astype(np.int64)
    keys = np.unique(owners[rooms >= 0] * 100_000 + rooms[rooms >= 0])
    objects, counts = np.unique(keys // 100_000, return_counts=True)
    report("furniture_inside", np.isin(owners, objects[counts > 1]), "it stands in two rooms")
    in_doorway = (points[:, 2] < 1.9) & _doorways(scene)[cells]
    report("furniture_inside", in_doorway, "it stands in a doorway")
    near = ndimage.binary_dilation(scene.occupied, np.ones((3, 3)))
    hidden = (points[:, 2] > 0.05) & (points[:, 2] < 0.45) & ~near[cells]
    report("grid_matches_mesh", hidden, "it stands where the grid says that the floor is free")
    return faults


def _cells(scene: Scene, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of points; those outside count as on the edge."""
    cells = np.floor((points[:, :2] - np.array(scene.grid.origin_m)) / scene.grid.resolution_m)
    cols, rows = np.clip(cells.astype(int), 0, [scene.grid.cols - 1, scene.grid.rows - 1]).T
    return rows, cols


def _deep_in_walls(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Which points have wall around them on all four sides."""
    wall = (scene.semantics == SemanticClass.WALL) & scene.occupied
    deep = np.ones(len(points), bool)
    for step in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        deep &= wall[_cells(scene, points[:, :2] + np.array(step) * _THROUGH_M)]
    return deep


def _doorways(scene: Scene) -> Bool[np.ndarray, "rows cols"]:
    """Cells between the jambs of doors."""
    mask = np.zeros(scene.grid.shape, bool)
    for door in scene.doors:
        steps = np.linspace(0.04, 0.96, 40)[:, None]
        points = door.segment_m[0] + steps * (door.segment_m[1] - door.segment_m[0])
        for x, y in points.tolist():
            row, col = scene.grid.cell_of(x, y)
            if 0 <= row < scene.grid.rows and 0 <= col < scene.grid.cols:
                mask[row, col] = True
    return mask


def _points_on(
    corners: Float[np.ndarray, "faces 3 3"], owners: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Corners, middles of edges and centres of triangles, with the object of each."""
    weights = np.array(
        [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0.5, 0], [0, 0.5, 0.5], [0.5, 0, 0.5], [1 / 3] * 3]
    )
    points = np.tensordot(weights, corners.astype(np.float64), axes=(1, 1))
    return points.reshape(-1, 3), np.tile(owners, len(weights))


def _escaping_rays(scene: Scene, views: int, rays: int) -> list[Fault]:
    """Places from which some ray meets nothing."""
    import trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    mesh = trimesh.Trimesh(scene.mesh.vertices_m, scene.mesh.faces, process=False)
    caster = RayMeshIntersector(mesh)
    space = FreeSpace.of(scene, _ROBOT_RADIUS_M)
    cells = np.argwhere(space.free)
    if len(cells) == 0:
        return []
    rng = np.random.default_rng(len(cells))
    faults = []
    for row, col in cells[rng.integers(len(cells), size=views)].tolist():
        directions = rng.standard_normal((rays, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        x, y = scene.grid.center_of(row, col)
        origin = np.tile([x, y, float(rng.uniform(0.1, 0.9 * scene.ceiling_m))], (rays, 1))
        missed = int((caster.intersects_first(origin, directions) < 0).sum())
        if missed:
            what = f"{missed} of {rays} rays leave the building"
            faults.append(Fault("watertight", f"point ({x:.2f}, {y:.2f})", what))
    return faults

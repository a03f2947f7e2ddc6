"""Furnished homes, as a pure function of a seed."""

import numpy as np

from toponav.core.errors import InputError
from toponav.worlds.furniture_library import FurnitureLibrary
from toponav.worlds.generate._home_canvas import Canvas
from toponav.worlds.generate._home_circulation import Link, borders, plan_cost
from toponav.worlds.generate._home_furnish import furnish_home
from toponav.worlds.generate._home_growth import Labels, grow_plan
from toponav.worlds.generate._home_program import FEWEST_ROOMS, MOST_ROOMS, RoomSpec, draw_program
from toponav.worlds.generate._home_shell import CELL_M, Opening, Shell, raise_shell
from toponav.worlds.generate._home_shell_mesh import build_shell
from toponav.worlds.generate._home_style import draw_palettes
from toponav.worlds.generate._home_walls import place_windows, wall_runs
from toponav.worlds.invariants import unreachable_rooms
from toponav.worlds.scene import Door, GridFrame, Provenance, Room, Scene

__all__ = ["HELD_OUT_SEEDS", "HOME_VERSION", "generate_home", "home_models"]

HOME_VERSION = "1"

HELD_OUT_SEEDS = range(2000, 3000)
"""Homes of these seeds are furnished with models and surfaces that no other home has."""

_PLANS, _GOOD_COST = 120, 2.0


def generate_home(
    seed: int, rooms: int | None = None, furniture: FurnitureLibrary | None = None
) -> Scene:
    """A home: rooms, doors, windows and furniture, with a textured mesh.

    Rooms grow from seeds inside an irregular outline; of many such plans the one with the best
    shapes, areas and doors is taken. Every room can be reached by a robot 0.36 m wide. The grid
    says where a robot with a camera mast up to 1.3 m can be, so tables block it as a whole.

    Args:
        seed: Any number from 0; the same seed makes the same home, byte for byte.
        rooms: Number of rooms with hallways, 2 to 9; drawn from the seed where None.
        furniture: Models to furnish with; parametric pieces where None.

    Raises:
        InputError: When the seed is negative or the number of rooms is out of range.

    Reference:
        Lopes et al. 2010, "A constrained growth method for procedural floor plan generation".

    Example:
        >>> scene = generate_home(3, rooms=4)
        >>> len(scene.rooms)
        4
    """
    if seed < 0:
        raise InputError(
            f"seed must be 0 or more, got {seed}",
            where="home generator",
            remedy="give a number from 0 up",
        )
    if rooms is not None and not FEWEST_ROOMS <= rooms <= MOST_ROOMS:
        raise InputError(
            f"a home has {FEWEST_ROOMS} to {MOST_ROOMS} rooms, got {rooms}",
            where="home generator",
            remedy=f"give a number of rooms from {FEWEST_ROOMS} to {MOST_ROOMS}",
        )
    return _build(seed, rooms, furniture)[0]


def home_models(
    seed: int, rooms: int | None = None, furniture: FurnitureLibrary | None = None
) -> dict[int, tuple[str, str]]:
    """Furniture class and model of each object in a home, by its instance in the mesh.

    Example:
        >>> len(home_models(3, rooms=4)) > 20
        True
    """
    return _build(seed, rooms, furniture)[1]


def _build(
    seed: int, rooms: int | None, furniture: FurnitureLibrary | None
) -> tuple[Scene, dict[int, tuple[str, str]]]:
    """The home and its models."""
    for attempt in range(40):
        rng = np.random.default_rng([seed, attempt])
        shell = _shell(rng, draw_program(rng, rooms))
        if shell is None:
            continue
        scene, models = _furnished(seed, shell, rng, furniture)
        if not unreachable_rooms(scene):
            return scene, models
    raise AssertionError(f"no home came of seed {seed}")


def _shell(rng: np.random.Generator, specs: tuple[RoomSpec, ...]) -> Shell | None:
    """The best of many plans with walls and doors; None where none can be lived in."""
    best: tuple[float, Labels, list[Link]] | None = None
    for number in range(_PLANS):
        labels = grow_plan(rng, specs)
        cost, links = plan_cost(specs, labels)
        if best is None or cost < best[0]:
            best = (cost, labels, links)
        if number >= 10 and best[0] < _GOOD_COST:
            break
    assert best is not None
    if best[0] > 100:
        return None
    return raise_shell(rng, specs, best[1], best[2], borders(best[1]))


def _furnished(
    seed: int, shell: Shell, rng: np.random.Generator, furniture: FurnitureLibrary | None
) -> tuple[Scene, dict[int, tuple[str, str]]]:
    """The furnished home of a shell."""
    held_out = seed in HELD_OUT_SEEDS
    canvas = Canvas(shell)
    runs = wall_runs(shell)
    place_windows(rng, shell, runs)
    palettes = draw_palettes(rng, shell.specs, held_out)
    build_shell(canvas, runs, palettes)
    furnish_home(rng, canvas, runs, palettes, held_out, furniture)
    scene = Scene(
        name=f"home-{seed}",
        grid=GridFrame(CELL_M, (0.0, 0.0), *shell.wall.shape),
        heights_m=canvas.heights_m,
        ceiling_m=shell.ceiling_m,
        room_index=shell.room_index,
        rooms=tuple(Room(spec.name, spec.kind) for spec in shell.specs),
        doors=tuple(_door(shell, opening) for opening in shell.openings),
        semantics=canvas.semantics,
        provenance=Provenance(
            "home", HOME_VERSION, seed, source="" if furniture is None else furniture.name
        ),
        imported_mesh=canvas.mesh(),
        attribution=canvas.attribution,
    )
    return scene, canvas.models


def _door(shell: Shell, opening: Opening) -> Door:
    names = [shell.specs[number].name for number in (opening.outer, opening.inner)]
    ends = [opening.point_m(opening.start, 0.0), opening.point_m(opening.stop, 0.0)]
    return Door(
        f"{names[0]}-{names[1]}_door",
        np.array(ends),
        round(opening.width_m, 3),
        (names[0], names[1]),
    )

"""The buildings of a dataset: made once, saved beside the trajectories, loaded from there."""

import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from toponav.core.errors import InputError, did_you_mean
from toponav.core.vocabulary import RoomKind
from toponav.data.dataset import building_dir, file_hash
from toponav.data.splits import office_name, office_seed
from toponav.maps.spec import TopologicalMap, load_map, save_map
from toponav.worlds.generate.suites import SUITES
from toponav.worlds.scene import Scene

__all__ = [
    "Building",
    "BuildingSource",
    "building_record",
    "load_building",
    "make_building",
    "resolve_buildings",
]

MAP_FILE: Final = "map.topo.json"
_OFFICES_APART = 389
"""A number without a common factor with the sizes of the suites."""


@dataclass(frozen=True, eq=False)
class Building:
    """A building as trajectories are driven in it.

    Attributes:
        name: Its folder's name.
        scene: What exists.
        map: Its topological map.
        map_hash: SHA-256 of the map's file.
    """

    name: str
    scene: Scene
    map: TopologicalMap
    map_hash: str

    @cached_property
    def kind_of(self) -> Callable[[str], RoomKind]:
        """Kind of a room by its name."""
        return {room.name: room.kind for room in self.scene.rooms}.__getitem__


@dataclass(frozen=True)
class BuildingSource:
    """Where a building comes from.

    Attributes:
        name: Name of its folder.
        kind: `office` (generated), `area` (the authors' yaml) or `scene` (a saved scene).
        seed: Seed of a generated office.
        path: The yaml or the folder.
    """

    name: str
    kind: str
    seed: int = 0
    path: str = ""


def resolve_buildings(
    buildings: Sequence[str], dataset_seed: int
) -> Callable[[int], BuildingSource]:
    """A function from a slot (0, 1, ...) to its building; the same for the same arguments.

    Args:
        buildings: The name of a suite of offices, or yaml files of areas and folders of
            saved scenes, which are used in turn.
        dataset_seed: Chooses which office of the suite comes first.

    Raises:
        InputError: A name is neither a suite nor a file, or both are mixed.
    """
    if len(buildings) == 1 and not Path(buildings[0]).exists():
        suite = buildings[0]
        _known_suite(suite)

        def office(slot: int) -> BuildingSource:
            seed = office_seed(suite, dataset_seed * _OFFICES_APART + slot)
            return BuildingSource(office_name(seed), "office", seed)

        return office
    sources = [_from_path(Path(name)) for name in buildings]
    if not sources or len({source.name for source in sources}) < len(sources):
        raise InputError(
            f"buildings must be given and have different names, got {', '.join(buildings)}",
            where="--buildings",
            remedy="give a suite such as offices-train, or yaml files and scene folders",
        )
    return lambda slot: sources[slot % len(sources)]


def _known_suite(name: str) -> None:
    names = [one.name for one in SUITES if one.generator == "office"]
    if name not in names:
        raise InputError(
            f"'{name}' is neither a suite of offices nor a file that exists",
            where="--buildings",
            remedy=did_you_mean(name, names),
        )


def _from_path(path: Path) -> BuildingSource:
    if path.is_dir():
        return BuildingSource(path.resolve().name, "scene", path=str(path.resolve()))
    if path.suffix in (".yaml", ".yml") and path.is_file():
        return BuildingSource(path.stem, "area", path=str(path.resolve()))
    raise InputError(
        f"'{path}' is neither an area's yaml file nor a scene folder",
        where="--buildings",
        remedy="give one suite such as offices-train, or paths that exist",
    )


def make_building(source: BuildingSource, dataset_dir: Path) -> Building:
    """The building, loaded from the dataset; made and saved there first where it is missing.

    It is always the saved copy that is used, so a dataset that is resumed drives in exactly
    the same building. Two workers may make the same one; the first to finish wins.
    """
    directory = building_dir(dataset_dir, source.name)
    if not directory.is_dir():
        from toponav.worlds.storage import save_scene

        scene, topological_map = _create(source)
        partial = directory.with_name(f".{source.name}.{os.getpid()}.partial")
        shutil.rmtree(partial, ignore_errors=True)
        partial.mkdir(parents=True)
        save_scene(scene, partial / source.name)
        save_map(topological_map, partial / source.name / MAP_FILE)
        try:
            os.rename(partial / source.name, directory)
        except OSError:  # another worker was faster
            if not directory.is_dir():
                raise
        shutil.rmtree(partial)
    return load_building(directory)


def _create(source: BuildingSource) -> tuple[Scene, TopologicalMap]:
    if source.kind == "office":
        from toponav.maps.construct import map_from_layout
        from toponav.worlds.generate.suites import suite_scene

        scene = suite_scene("office", source.seed)
        return scene, map_from_layout(scene)
    if source.kind == "area":
        from toponav.maps.formats.canvas import load_area_map
        from toponav.worlds.load.stanford import load_area

        return load_area(Path(source.path)), load_area_map(Path(source.path))
    from toponav.worlds.storage import load_scene

    return load_scene(Path(source.path)), load_map(Path(source.path) / MAP_FILE)


def load_building(directory: Path) -> Building:
    """A building of a dataset.

    Raises:
        InputError: Its files are missing or broken.
    """
    from toponav.worlds.storage import load_scene

    scene = load_scene(directory)
    map_path = directory / MAP_FILE
    return Building(directory.name, scene, load_map(map_path), file_hash(map_path))


def building_record(directory: Path) -> dict[str, Any]:
    """What the manifest says of a building: a hash per file."""
    files = sorted(path for path in directory.rglob("*") if path.is_file())
    return {"files": {str(path.relative_to(directory)): file_hash(path) for path in files}}

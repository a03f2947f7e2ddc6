"""Panoramas taken at random in many homes, stored so that training reads what it wants.

A folder holds `panoramas.json` and a folder per home: `rgb.npy` (uint8), `depth_mm.npy` (uint16
millimetres), `poses.npy` (float64: x, y, yaw), `ground.npz` for the labels, and `home.json`, which
is written last. Panorama k of a home is a pure function of the seed, the home and k, so an
interrupted collection goes on with the first home that is not complete.
"""

import dataclasses
import io
import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float64, UInt8, UInt16

from toponav.core.arrays import map_npy
from toponav.core.camera import PanoramaCamera
from toponav.core.errors import InputError
from toponav.core.files import (
    check_out_folder,
    read_json_object,
    write_atomically,
)
from toponav.core.geometry import Pose2
from toponav.core.imagenav import PANORAMA_SHAPE
from toponav.core.typed_json import from_json
from toponav.data.engine import Engine, run_tasks
from toponav.data.nts.ground import CAMERA_HEIGHT_M, Ground
from toponav.sim.render import make_renderer
from toponav.worlds.generate.suites import suite, suite_scene

__all__ = ["HomePanoramas", "PanoramaConfig", "collect_panoramas", "open_panoramas"]

_MANIFEST = "panoramas.json"
_HOME = "home.json"
_MILLIMETRES = 1000.0
_REMEDY = "delete the home's folder and run the collection again"


@dataclass(frozen=True)
class PanoramaConfig:
    """What to collect; with the code's version it determines every pixel."""

    suite: Literal["homes-train", "homes-val", "homes-test"] = "homes-train"
    """Homes to take them in."""
    homes: int = 68
    """How many of the suite's homes, from the first."""
    panoramas: int = 300
    """How many in each home."""
    height: int = PANORAMA_SHAPE[0]
    """Rows of an image."""
    width: int = PANORAMA_SHAPE[1]
    """Columns of an image."""
    seed: int = 0
    """Seed of where they are taken."""

    def __post_init__(self) -> None:
        most = len(suite(self.suite).seeds)
        checks = {
            "homes": (1 <= self.homes <= most, f"1 to {most} in {self.suite}"),
            "panoramas": (1 <= self.panoramas <= 10_000, "1 to 10,000"),
            "seed": (0 <= self.seed < 2**63, "0 or more"),
        }
        for name, (holds, valid) in checks.items():
            if not holds:
                raise InputError(
                    f"{name} must be {valid}, got {getattr(self, name)}",
                    where=f"--{name}",
                    remedy=f"give {valid}",
                )
        self.camera.rays_in_robot()

    @property
    def camera(self) -> PanoramaCamera:
        """The camera that takes them."""
        return PanoramaCamera(self.height, self.width, mount_height_m=CAMERA_HEIGHT_M)


@dataclass(frozen=True)
class _HomeRecord:
    """What `home.json` holds."""

    scene_suite: str
    scene_seed: int
    content_hash: str
    rooms: tuple[str, ...]
    config: PanoramaConfig


@dataclass(frozen=True, eq=False)
class HomePanoramas:
    """The panoramas of one home; images stay on disk until they are read.

    Attributes:
        folder: Where they are.
        scene_suite: Suite of the home.
        scene_seed: Seed of the home.
        content_hash: Hash of the home that they were taken in.
        rooms: Kind of each of its rooms, by the numbers in `ground.room_index`.
        config: What was collected.
    """

    folder: Path
    scene_suite: str
    scene_seed: int
    content_hash: str
    rooms: tuple[str, ...]
    config: PanoramaConfig

    def __len__(self) -> int:
        return self.config.panoramas

    @cached_property
    def rgb(self) -> UInt8[np.ndarray, "panoramas height width 3"]:
        """Colour images, mapped from the disk."""
        shape = (len(self), self.config.height, self.config.width, 3)
        return map_npy(self.folder / "rgb.npy", "uint8", shape, remedy=_REMEDY)

    @cached_property
    def depth_mm(self) -> UInt16[np.ndarray, "panoramas height width"]:
        """Depth in millimetres, mapped from the disk."""
        shape = (len(self), self.config.height, self.config.width)
        return map_npy(self.folder / "depth_mm.npy", "uint16", shape, remedy=_REMEDY)

    @cached_property
    def poses(self) -> Float64[np.ndarray, "panoramas 3"]:
        """Where each was taken: x, y and yaw in the home's frame."""
        mapped = map_npy(self.folder / "poses.npy", "float64", (len(self), 3), remedy=_REMEDY)
        return np.array(mapped)

    @cached_property
    def ground(self) -> Ground:
        """Where one can stand and see in the home."""
        return Ground.load(self.folder / "ground.npz")


def collect_panoramas(
    out: Path,
    config: PanoramaConfig = PanoramaConfig(),
    *,
    workers: int = 1,
    engine: Engine = "local",
    on_progress: Callable[[int], None] | None = None,
) -> list[HomePanoramas]:
    """Take what is missing; the homes in order.

    Args:
        out: Folder of the collection.
        config: What to collect.
        workers: Processes.
        engine: Where they run; on a cluster all machines must see the folder.
        on_progress: Told how many homes are done.

    Raises:
        InputError: The folder holds another collection, or cannot be written to.
    """
    check_out_folder(out)
    manifest = out / _MANIFEST
    if manifest.exists():
        found = _read_config(manifest)
        grown = dataclasses.replace(found, homes=config.homes, panoramas=config.panoramas)
        if grown != config:
            raise InputError(
                f"the folder holds another collection: {found}",
                where=f"--out {out}",
                remedy="give the same seed, suite and size, or another folder",
            )
    write_atomically(manifest, json.dumps(dataclasses.asdict(config), indent=1) + "\n")
    tasks = [(out, config, seed) for seed in suite(config.suite).seeds[: config.homes]]
    run_tasks(_collect_home, tasks, workers, engine=engine, on_poll=on_progress)
    return open_panoramas(out)


def open_panoramas(folder: Path, *, partial: bool = False) -> list[HomePanoramas]:
    """The homes of a collection, in the suite's order.

    Args:
        folder: What `collect_panoramas` wrote to.
        partial: Take the homes that are there while others are missing.

    Raises:
        InputError: There is no collection, or homes are missing or of another collection.
    """
    config = _read_config(folder / _MANIFEST)
    homes, missing = [], 0
    for seed in suite(config.suite).seeds[: config.homes]:
        home = _read_home(_folder_of(folder, config, seed), config)
        missing += home is None
        if home is not None:
            homes.append(home)
    if not homes or (missing and not partial):
        raise InputError(
            f"{missing} of {config.homes} homes are not collected",
            where=str(folder),
            remedy="run toponav collect nts with the same --out again, which adds them",
        )
    return homes


def sample_pose(ground: Ground, seed: int, scene_seed: int, number: int) -> Pose2:
    """Where panorama `number` of a home is taken: anywhere free, facing anywhere."""
    rng = np.random.default_rng([seed, scene_seed, number])
    cell = ground.cells[int(rng.integers(len(ground.cells)))]
    x_m, y_m = ground.grid.center_of(*cell.tolist())
    half_m = ground.grid.resolution_m / 2
    dx_m, dy_m = rng.uniform(-half_m, half_m, 2).tolist()
    return Pose2(x_m + dx_m, y_m + dy_m, float(rng.uniform(-math.pi, math.pi)))


def _collect_home(task: tuple[Path, PanoramaConfig, int]) -> None:
    out, config, seed = task
    folder = _folder_of(out, config, seed)
    if _read_home(folder, config) is not None:
        return
    scene = suite_scene(suite(config.suite).generator, seed)
    ground = Ground.of(scene)
    renderer = make_renderer(scene, config.camera)
    count, shape = config.panoramas, (config.height, config.width)
    rgb = np.empty((count, *shape, 3), np.uint8)
    depth_mm = np.empty((count, *shape), np.uint16)
    poses = np.empty((count, 3))
    for number in range(count):
        pose = sample_pose(ground, config.seed, seed, number)
        seen = renderer.render_images(pose, ("rgb", "depth"))
        assert seen.depth_m is not None
        assert seen.rgb is not None
        rgb[number] = seen.rgb
        depth_mm[number] = np.rint(seen.depth_m * _MILLIMETRES)
        poses[number] = pose
    for name, array in (("rgb", rgb), ("depth_mm", depth_mm), ("poses", poses)):
        content = io.BytesIO()
        np.save(content, array)
        write_atomically(folder / f"{name}.npy", content.getvalue())
    ground.save(folder / "ground.npz")
    record = _HomeRecord(
        config.suite, seed, scene.content_hash, tuple(room.kind for room in scene.rooms), config
    )
    write_atomically(folder / _HOME, json.dumps(dataclasses.asdict(record), indent=1) + "\n")


def _folder_of(out: Path, config: PanoramaConfig, seed: int) -> Path:
    return out / f"{config.suite}-{seed:04d}"


def _read_home(folder: Path, config: PanoramaConfig) -> HomePanoramas | None:
    """The home in this folder; None where it is not complete or holds fewer panoramas."""
    if not (folder / _HOME).exists():
        return None
    record = from_json(
        _HomeRecord, read_json_object(folder / _HOME), where=str(folder / _HOME), remedy=_REMEDY
    )
    same = dataclasses.replace(record.config, homes=config.homes) == config
    if not same:
        return None
    values = {item.name: getattr(record, item.name) for item in dataclasses.fields(record)}
    return HomePanoramas(folder, **values)


def _read_config(path: Path) -> PanoramaConfig:
    return from_json(
        PanoramaConfig,
        read_json_object(path),
        where=str(path),
        remedy="name a folder that toponav collect nts wrote",
    )

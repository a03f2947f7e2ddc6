"""Sequences of compact panoramas with the shortest-path expert's actions, home by home.

A folder holds `demonstrations.json` and a folder a home: `image.npy`, `goal.npy` (of each
episode), `sensors.npy`, `action.npy` (the expert's) and `episode.npy`, and `home.json`, which is
written last. The drives of a home are a pure function of the configuration and the home, so an
interrupted collection goes on with the first home that is not complete, on any number of
processes.
"""

import dataclasses
import hashlib
import io
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np

from toponav.core.arrays import map_npy
from toponav.core.errors import InputError
from toponav.core.files import check_out_folder, hash_of_file, read_json_object, write_atomically
from toponav.core.imagenav import Action
from toponav.core.typed_json import from_json
from toponav.data.engine import Engine, run_tasks
from toponav.data.nts.shortest_path import ShortestPathAgent
from toponav.models.baselines.image_goal_presets import (
    SENSORS,
    ImageGoalConfig,
    ImageGoalKind,
    ImageGoalPresetName,
    image_goal_preset,
)
from toponav.models.baselines.image_goal_weights import load_image_goal
from toponav.navigation.baselines.image_goal_agent import ImageGoalAgent
from toponav.navigation.baselines.senses import Senses
from toponav.training.image_goals.homes import HomeShelf, Route, camera_of, observation_of
from toponav.worlds.generate.suites import suite

__all__ = [
    "DemonstrationConfig",
    "HomeDrives",
    "collect_demonstrations",
    "open_demonstrations",
]

_MANIFEST, _HOME = "demonstrations.json", "home.json"
_REMEDY = "delete the home's folder and run the collection again"
_TURN_STEPS = 12


@dataclass(frozen=True)
class DemonstrationConfig:
    """What to collect; with the code's version it determines every frame."""

    suite: Literal["homes-train", "homes-val"] = "homes-train"
    """Homes to drive in."""
    homes: int = 68
    """How many of the suite's homes, from the first."""
    episodes: int = 24
    """Drives in each home."""
    near_m: float = 1.5
    """Shortest paths are at least so long."""
    far_m: float = 10.0
    """And shorter than this."""
    max_steps: int = 150
    """A drive ends here where the goal was not reached."""
    preset: ImageGoalPresetName = "compact"
    """Whose panoramas."""
    depth: bool = True
    """Whether with depth; a compact policy that sees colour alone takes panoramas of its own."""
    seed: int = 0
    """Seed of the drives."""
    learner: str | None = None
    """Folder of weights that drive beside the expert (DAgger); None for the expert alone."""
    learner_name: str = "il_rgbd"
    """Which policy of that folder drives."""
    expert_share: float = 0.3
    """Share of the time that the expert drives where there is a learner."""

    def __post_init__(self) -> None:
        most = len(suite(self.suite).seeds)
        checks = {
            "homes": (1 <= self.homes <= most, f"1 to {most} in {self.suite}"),
            "episodes": (1 <= self.episodes <= 100_000, "1 to 100,000"),
            "near_m": (0.0 < self.near_m < self.far_m <= 100.0, "above 0 and below far_m"),
            "max_steps": (1 <= self.max_steps <= 500, "1 to 500"),
            "seed": (0 <= self.seed < 2**53, "0 or more"),
            "expert_share": (0.0 <= self.expert_share <= 1.0, "0 to 1"),
        }
        for name, (holds, valid) in checks.items():
            if not holds:
                raise InputError(
                    f"{name} must be {valid}, got {getattr(self, name)}",
                    where=f"--{name.replace('_', '-')}",
                    remedy=f"give {valid}",
                )

    @property
    def network(self) -> ImageGoalConfig:
        """A network that takes these panoramas."""
        kind: ImageGoalKind = "il"
        return image_goal_preset(kind, self.preset, depth=self.depth)


@dataclass(frozen=True)
class _HomeRecord:
    """What `home.json` holds."""

    frames: int
    episodes: int
    reached: int
    config: DemonstrationConfig


@dataclass(frozen=True, eq=False)
class HomeDrives:
    """The drives of one home.

    Attributes:
        image: uint8[frames, channels, rows, cols], as `picture_of` makes them.
        goal: uint8[episodes, channels, rows, cols].
        sensors: float32[frames, sensors].
        action: int8[frames], what the expert would do.
        episode: int32[frames], number of the drive; its frames follow each other.
        reached: Drives that ended at their goal.
        name: The home's.
        folder: Where they are; what is made of the pictures is kept there too.
    """

    image: np.ndarray
    goal: np.ndarray
    sensors: np.ndarray
    action: np.ndarray
    episode: np.ndarray
    reached: int
    name: str
    folder: Path | None = None


def collect_demonstrations(
    out: Path,
    config: DemonstrationConfig = DemonstrationConfig(),
    *,
    workers: int = 1,
    engine: Engine = "local",
    homes_folder: Path | None = None,
    on_progress: Callable[[int], None] | None = None,
) -> list[HomeDrives]:
    """Drive what is missing; the homes in order.

    Args:
        out: Folder of the collection.
        config: What to collect.
        workers: Processes.
        engine: Where they run.
        homes_folder: Where homes are kept between runs; None makes them again.
        on_progress: Told how many homes are done.

    Raises:
        InputError: The folder holds another collection, or cannot be written to.
    """
    check_out_folder(out)
    if config.learner is not None:
        learner = load_image_goal(config.learner_name, config.learner).config
        if camera_of(learner) != camera_of(config.network):
            raise InputError(
                f"{config.learner_name} sees other panoramas than are collected",
                where="--learner-name",
                remedy="collect with the learner's --modality and --preset",
            )
    manifest = out / _MANIFEST
    if manifest.exists():
        found = _read_config(manifest)
        if dataclasses.replace(found, homes=config.homes) != config:
            raise InputError(
                f"the folder holds another collection: {found}",
                where=f"--out {out}",
                remedy="give the same options, or another folder",
            )
    write_atomically(manifest, json.dumps(dataclasses.asdict(config), indent=1) + "\n")
    tasks = [
        (home, config, homes_folder)
        for home in range(config.homes)
        if not (_folder_of(out, config, home) / _HOME).is_file()
    ]
    there = config.homes - len(tasks)
    run_tasks(
        drive_home,
        tasks,
        workers,
        engine=engine,
        on_result=lambda task, drives: _save(_folder_of(out, config, task[0]), config, drives),
        on_poll=None if on_progress is None else lambda done: on_progress(there + done),
    )
    return open_demonstrations([out])


def open_demonstrations(folders: list[Path]) -> list[HomeDrives]:
    """The homes of collections, those that are complete, mapped from the disk.

    Raises:
        InputError: There is no collection, or no home of it is complete.
    """
    homes = []
    for folder in folders:
        config = _read_config(folder / _MANIFEST)
        for home in range(config.homes):
            path = _folder_of(folder, config, home)
            if (path / _HOME).is_file():
                homes.append(_open_home(path, config))
    if not homes:
        raise InputError(
            "no home is complete",
            where=", ".join(map(str, folders)),
            remedy="run toponav collect imitation with the same --out again",
        )
    return homes


def digest_of(folders: list[Path]) -> str:
    """Identifies collections by what they hold."""
    digest = hashlib.sha256()
    for folder in folders:
        for path in sorted(folder.glob("*/action.npy")):
            digest.update(f"{path.parent.name} {hash_of_file(path)}".encode())
            digest.update(hash_of_file(path.with_name("sensors.npy")).encode())
    return digest.hexdigest()


def drive_home(task: tuple[int, DemonstrationConfig, Path | None]) -> dict[str, np.ndarray]:
    """The drives of one home, by its number."""
    import torch

    home, config, folder = task
    torch.set_num_threads(1)
    network = config.network
    shelf = HomeShelf(
        config.suite,
        config.homes,
        camera_of(network),
        folder=folder,
        kept=1,
        max_steps=config.max_steps,
    )
    learner = _learner(config.learner_name, config.learner)
    drives = []
    for number in range(config.episodes):
        rng = np.random.default_rng([config.seed, shelf.seeds[home], number])
        route = shelf.route(home, config.near_m, config.far_m, rng)
        drives.append(_drive(shelf, route, learner, config, rng))
    return {
        "image": np.concatenate([one["image"] for one in drives]),
        "goal": np.stack([one["goal"] for one in drives]),
        "sensors": np.concatenate([one["sensors"] for one in drives]),
        "action": np.concatenate([one["action"] for one in drives]),
        "episode": np.repeat(
            np.arange(len(drives), dtype=np.int32), [len(one["action"]) for one in drives]
        ),
        "reached": np.array([bool(one["reached"]) for one in drives]),
    }


@lru_cache(maxsize=1)
def _learner(name: str, weights: str | None) -> ImageGoalAgent | None:
    return None if weights is None else ImageGoalAgent(load_image_goal(name, weights))


def _drive(
    shelf: HomeShelf,
    route: Route,
    learner: ImageGoalAgent | None,
    config: DemonstrationConfig,
    rng: np.random.Generator,
) -> dict[str, np.ndarray]:
    """One drive. With a learner, expert and learner take turns of random lengths.

    Where the learner would stop but the expert would not, the expert has that step.

    Reference:
        Ross, Gordon, Bagnell 2011, arXiv:1011.0686.
    """
    env = shelf.env(route.home)
    seen, info = env.reset(
        seed=int(rng.integers(2**31)), options={"start": route.start, "goal": route.goal}
    )
    expert, senses = ShortestPathAgent(), Senses(config.network)
    goal = env.goal
    expert.attach_truth(env.simulation)
    expert.reset(goal)
    images, felt, actions = [], [], []
    picture = senses.reset(goal)
    if learner is not None:
        learner.reseed(int(rng.integers(2**31)))
        learner.reset(goal)
    leads, last, over = True, None, False
    while not over:
        observation = observation_of(seen, info["step"])
        inputs = senses.observe(observation, last)
        wanted = expert.act(observation)
        images.append(inputs["image"])
        felt.append(inputs["sensors"])
        actions.append(int(wanted))
        last = wanted
        if learner is not None:
            if rng.random() < 1.0 / _TURN_STEPS or len(actions) == 1:
                leads = bool(rng.random() < config.expert_share)
            choice = learner.act(observation)
            if not (leads or choice == Action.STOP or wanted == Action.STOP):
                last = choice
            learner.did(last)
        seen, _, terminated, truncated, info = env.step(int(last))
        over = terminated or truncated
    return {
        "image": np.stack(images),
        "goal": picture,
        "sensors": np.stack(felt),
        "action": np.array(actions, np.int8),
        "reached": np.array(info["success"]),
    }


def _save(folder: Path, config: DemonstrationConfig, drives: dict[str, np.ndarray]) -> None:
    for name in ("image", "goal", "sensors", "action", "episode"):
        content = io.BytesIO()
        np.save(content, drives[name])
        write_atomically(folder / f"{name}.npy", content.getvalue())
    record = _HomeRecord(
        len(drives["action"]), len(drives["goal"]), int(drives["reached"].sum()), config
    )
    write_atomically(folder / _HOME, json.dumps(dataclasses.asdict(record), indent=1) + "\n")


def _open_home(folder: Path, config: DemonstrationConfig) -> HomeDrives:
    record = from_json(
        _HomeRecord, read_json_object(folder / _HOME), where=str(folder / _HOME), remedy=_REMEDY
    )
    size = (config.network.channels, config.network.rows, config.network.cols)

    def mapped(name: str, dtype: str, shape: tuple[int, ...]) -> np.ndarray:
        return map_npy(folder / f"{name}.npy", dtype, shape, remedy=_REMEDY)

    return HomeDrives(
        mapped("image", "uint8", (record.frames, *size)),
        mapped("goal", "uint8", (record.episodes, *size)),
        mapped("sensors", "float32", (record.frames, SENSORS)),
        mapped("action", "int8", (record.frames,)),
        mapped("episode", "int32", (record.frames,)),
        record.reached,
        folder.name,
        folder,
    )


def _folder_of(out: Path, config: DemonstrationConfig, home: int) -> Path:
    return out / f"{config.suite}-{suite(config.suite).seeds[home]:04d}"


def _read_config(path: Path) -> DemonstrationConfig:
    return from_json(
        DemonstrationConfig,
        read_json_object(path),
        where=str(path),
        remedy="name a folder that toponav collect imitation wrote",
    )

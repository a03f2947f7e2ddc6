"""Runs single image-goal episodes; what it returns depends on the episode alone."""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import MAX_STEPS, ImageNavAgent, ImageNavEpisode
from toponav.evaluation.imagenav.agents import (
    ImageNavChoice,
    ImageNavContext,
    make_image_nav_agent,
)
from toponav.evaluation.imagenav.episode import ImageNavRecord, OnStep, run_episode
from toponav.evaluation.provenance import hash_of_code, hash_of_weights
from toponav.evaluation.suite import seed_of
from toponav.sim.imagenav import LOCOBOT, ImageNavSimulation
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.generate.suites import suite, suite_scene
from toponav.worlds.scene import Scene

__all__ = ["ImageNavSettings", "ImageNavWorker", "sequential_goals"]

_CODE = tuple(f"evaluation/imagenav/{name}.py" for name in ("agents", "episode", "worker"))
_MOST_GOALS = 50
_NEXT_M = (1.5, 5.0)


@dataclass(frozen=True)
class ImageNavSettings:
    """Everything besides episode and agent that a record depends on."""

    noise: bool = True
    """Whether actions and odometry are as bad as a LoCoBot's."""
    stop: bool = True
    """Whether the robot has to say that it is there."""
    sliding: bool = False
    """Whether the robot slides along what it touches."""
    goals: int = 1
    """Goals one after the other; those after the first 1.5 to 5 m from the last."""
    max_steps: int = MAX_STEPS
    """Steps for each goal."""
    weights: str | None = None
    """Weights of the learned agents: a folder or a preset; None is what ships."""
    seed: int = 0
    """Seed of the noise, of the goals after the first and of the agents."""

    def __post_init__(self) -> None:
        checks = {
            "goals": (1 <= self.goals <= _MOST_GOALS, f"1 to {_MOST_GOALS}"),
            "max_steps": (1 <= self.max_steps <= 100_000, "1 to 100,000"),
            "seed": (0 <= self.seed < 2**53, "0 or more"),
        }
        for name, (holds, valid) in checks.items():
            if not holds:
                raise InputError(
                    f"{name} must be {valid}, got {getattr(self, name)}",
                    where=f"--{name.replace('_', '-')}",
                    remedy=f"give {valid}",
                )

    @property
    def variant(self) -> dict[str, Any]:
        """What is said of it in the results."""
        return {
            "noise": self.noise,
            "stop": self.stop,
            "sliding": self.sliding,
            "goals": self.goals,
        }


class ImageNavWorker:
    """Keeps agents and the last building, and runs the episodes that it is asked for.

    The noise depends on the episode, not on the agent, so that agents are compared in pairs; an
    agent's own random numbers depend on (seed, agent, episode).

    Args:
        settings: What the episodes depend on.
        choices: The agents.
    """

    def __init__(self, settings: ImageNavSettings, choices: Iterable[ImageNavChoice]) -> None:
        self.settings = settings
        self.choices = {choice.label: choice for choice in choices}
        self._agents: dict[str, ImageNavAgent] = {}
        self._hashes: dict[str | None, str] = {}
        self._simulations: dict[bool, ImageNavSimulation] = {}
        self._warm: set[str] = set()

    def key(self, label: str, episode: ImageNavEpisode) -> str:
        """A hash of everything that the episode's record depends on, this package's code too."""
        choice = self.choices[label]
        settings = {**asdict(self.settings), "weights": self.weights_hash(label)}
        description = {
            "code": hash_of_code(_CODE),
            "agent": choice.agent,
            "options": choice.options,
            "episode": asdict(episode),
            "settings": settings,
        }
        return hashlib.sha256(json.dumps(description, sort_keys=True).encode()).hexdigest()

    def weights_of(self, label: str) -> str | None:
        """The folder or preset of weights that an agent gets; None is what ships."""
        return self.choices[label].weights or self.settings.weights

    def weights_hash(self, label: str) -> str:
        """SHA-256 over the agent's weights; empty for one that has none."""
        if not self.choices[label].is_learned:
            return ""
        weights = self.weights_of(label)
        if weights not in self._hashes:
            self._hashes[weights] = hash_of_weights(weights)
        return self._hashes[weights]

    def prepare(self, label: str) -> None:
        """Build the agent now, so that broken weights are found before anything is run."""
        self._agent(label, 0)

    def run(
        self, label: str, episode: ImageNavEpisode, on_step: OnStep | None = None
    ) -> ImageNavRecord:
        """The record of one episode.

        Args:
            label: Label of a choice.
            episode: Which episode.
            on_step: Called after each action.
        """
        simulation = self.simulation(episode, depth=self.choices[label].depth)
        goals = sequential_goals(
            simulation.free_space,
            episode,
            self.settings.goals - 1,
            seed_of("goals", self.settings.seed, episode.id),
        )
        if label not in self._warm:
            self._warm.add(label)
            self._warm_up(label, simulation, episode)
        return run_episode(
            simulation,
            self._agent(
                label, seed_of("agent", self.settings.seed, self.choices[label].agent, episode.id)
            ),
            episode,
            label=label,
            seed=seed_of("noise", self.settings.seed, episode.id),
            more_goals=goals,
            on_step=on_step,
        )

    def simulation(self, episode: ImageNavEpisode, *, depth: bool) -> ImageNavSimulation:
        """The robot in the episode's building; the last building is kept."""
        scene = _scene(suite(episode.scene_suite).generator, episode.scene_seed)
        kept = self._simulations.get(depth)
        if kept is None or kept.scene is not scene:
            settings = self.settings
            kept = ImageNavSimulation(
                scene,
                depth=depth,
                noise=LOCOBOT if settings.noise else None,
                sliding=settings.sliding,
                stop=settings.stop,
                max_steps=settings.max_steps,
            )
            self._simulations[depth] = kept
        return kept

    def _warm_up(
        self, label: str, simulation: ImageNavSimulation, episode: ImageNavEpisode
    ) -> None:
        """Three steps that are thrown away, so that compiling counts for no episode."""
        other = ImageNavSimulation(simulation.scene, depth=simulation.depth, max_steps=3)
        run_episode(other, self._agent(label, 0), episode, label=label, seed=0)

    def _agent(self, label: str, seed: int) -> ImageNavAgent:
        """The agent with its random numbers started afresh."""
        kept: Any = self._agents.get(label)
        if kept is not None and hasattr(kept, "reseed"):
            kept.reseed(seed)
            return self._agents[label]
        choice = self.choices[label]
        context = ImageNavContext(
            weights=self.weights_of(label), seed=seed, options=dict(choice.options)
        )
        self._agents[label] = make_image_nav_agent(choice.agent, context)
        return self._agents[label]


@lru_cache(maxsize=1)
def _scene(generator: str, seed: int) -> Scene:
    return suite_scene(generator, seed)


def sequential_goals(
    space: FreeSpace, episode: ImageNavEpisode, count: int, seed: int
) -> tuple[Pose2, ...]:
    """Goals after the first: each 1.5 to 5 m from the last along the shortest path.

    Where a small building has no place so far away, the farthest place stands in.

    Reference:
        Chaplot et al. 2020, section 6.1.
    """
    rng = np.random.default_rng(seed)
    goals: list[Pose2] = []
    last = episode.goal
    for _ in range(count):
        field_m = space.geodesic_m((last.x_m, last.y_m))
        far = np.where(np.isfinite(field_m) & space.free, field_m, -1.0)
        cells = np.argwhere((far >= _NEXT_M[0]) & (far < _NEXT_M[1]))
        if not len(cells):
            cells = np.argwhere(far == far.max())
        row, col = cells[rng.integers(len(cells))].tolist()
        last = Pose2(*space.grid.center_of(row, col), float(rng.uniform(-np.pi, np.pi)))
        goals.append(last)
    return tuple(goals)

"""Two rooms to search in, and agents that follow orders."""

from collections.abc import Iterable
from functools import cache

import torch

from tests.sim.two_rooms import two_rooms
from toponav.core.geometry import Pose2
from toponav.core.imagenav import Action, ImageGoal, ImageNavBelief, ImageNavEpisode
from toponav.core.imagenav import PanoramaObservation as Observation
from toponav.evaluation.imagenav.episode import GoalRecord, ImageNavRecord
from toponav.models.nts.network import NTSNetwork
from toponav.models.nts.presets import get_nts_preset
from toponav.sim.imagenav import ImageNavSimulation
from toponav.worlds.scene import Scene

START, GOAL = Pose2(2.0, 3.0, 0.0), Pose2(4.0, 3.0, 1.0)


def episode(number: int = 0, goal: Pose2 = GOAL, length_m: float = 2.0) -> ImageNavEpisode:
    """From the left room to a place; `homes-val` stands for the two rooms."""
    return ImageNavEpisode("homes-val", 1000, START, goal, length_m, "easy", number)


@cache
def building() -> Scene:
    """The two rooms, one object."""
    return two_rooms()


def simulation(**options) -> ImageNavSimulation:  # type: ignore[no-untyped-def]
    """The robot in the two rooms, without noise."""
    return ImageNavSimulation(building(), **{"noise": None, **options})


@cache
def network(depth: bool = True) -> NTSNetwork:
    """A network that has learned nothing."""
    torch.manual_seed(0)
    return NTSNetwork(get_nts_preset("compact", depth=depth)).eval()


class Scripted:
    """Does what it was told, then turns for ever."""

    def __init__(self, actions: Iterable[Action] = ()) -> None:
        self.script = list(actions)
        self.left: list[Action] = []
        self.resets: list[bool] = []
        self.denied = 0

    def reset(self, goal: ImageGoal, keep_map: bool = False) -> None:
        self.resets.append(keep_map)
        self.left = list(self.script)

    def act(self, observation: Observation) -> Action:
        return self.left.pop(0) if self.left else Action.LEFT

    def stop_denied(self) -> None:
        self.denied += 1

    def belief(self) -> ImageNavBelief:
        return ImageNavBelief(mode="scripted", stopped_because="" if self.left else "told so")


def scripted(context: object) -> Scripted:
    """For `module:factory`."""
    return Scripted([Action.FORWARD] * 5 + [Action.STOP])


def record(
    agent: str,
    number: int,
    outcomes: str,
    path_m: float = 4.0,
    level: str = "easy",
    length_m: float = 2.0,
) -> ImageNavRecord:
    """A made-up record; a letter a goal: s success, w wrong stop, t timeout."""
    words = {"s": "success", "w": "wrong_stop", "t": "timeout"}
    goals = tuple(
        GoalRecord(GOAL, length_m, words[letter], path_m, 0.5, 30, 2)  # type: ignore[arg-type]
        for letter in outcomes
    )
    given = ImageNavEpisode("homes-val", 1000, START, GOAL, length_m, level, number)  # type: ignore[arg-type]
    return ImageNavRecord(agent, given, 5, goals, (), 1.0)

"""Image-goal navigation: what passes between a robot with a panoramic camera and an agent."""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal, Protocol, get_args, runtime_checkable

import numpy as np
from jaxtyping import Float, Float32, UInt8

from toponav.core.errors import InputError, did_you_mean
from toponav.core.geometry import Pose2, wrap_angle

__all__ = [
    "DIFFICULTIES",
    "DIFFICULTY_M",
    "DIRECTIONS",
    "FORWARD_M",
    "IMAGE_NAV_ROBOT_RADIUS_M",
    "MAX_STEPS",
    "NODE_RADIUS_M",
    "PANORAMA_SHAPE",
    "SUCCESS_RADIUS_M",
    "TURN_RAD",
    "Action",
    "BeliefEdge",
    "BeliefGhost",
    "BeliefNode",
    "Difficulty",
    "ImageGoal",
    "ImageNavAgent",
    "ImageNavBelief",
    "ImageNavEpisode",
    "PanoramaObservation",
    "bin_of_direction",
    "direction_of_bin",
]

FORWARD_M = 0.25
"""What one step forward is meant to drive."""
TURN_RAD = math.radians(10.0)
"""What one turn is meant to turn."""
MAX_STEPS = 500
"""Length of an episode, `STOP` included."""
SUCCESS_RADIUS_M = 1.0
"""Stopping at most so far, along the shortest path, from the goal is success."""
NODE_RADIUS_M = 3.0
"""Radius of a node of the topological map."""
DIRECTIONS = 12
"""Directions around the robot: bin 0 is centred on forward, the others follow to the left."""
PANORAMA_SHAPE = (128, 512)
"""Rows and columns of a panorama; the middle column looks forward, yaw falls to the right."""
IMAGE_NAV_ROBOT_RADIUS_M = 0.18
"""Radius of the robot, a LoCoBot."""

Difficulty = Literal["easy", "medium", "hard"]
DIFFICULTIES: tuple[Difficulty, ...] = get_args(Difficulty)
"""Every difficulty, the easiest first."""
DIFFICULTY_M: dict[Difficulty, tuple[float, float]] = {
    "easy": (1.5, 3.0),
    "medium": (3.0, 5.0),
    "hard": (5.0, 10.0),
}
"""The shortest path's length of each difficulty: at least the first, below the second."""


class Action(IntEnum):
    """What the robot can do in one step; the numbers are those of the Gymnasium environment."""

    STOP = 0
    FORWARD = 1
    LEFT = 2
    RIGHT = 3


@dataclass(frozen=True, eq=False)
class PanoramaObservation:
    """What the robot senses after each action.

    Attributes:
        rgb: The panorama.
        depth_m: Its depth where the robot has a depth camera; 0 where nothing was seen.
        odometry: Where the wheels say that it is, in the frame of its start; errors add up.
        collided: Whether the last action was blocked; None where the robot cannot tell.
        step: Actions taken in this episode.
    """

    rgb: UInt8[np.ndarray, "height width 3"]
    depth_m: Float32[np.ndarray, "height width"] | None
    odometry: Pose2
    collided: bool | None
    step: int


@dataclass(frozen=True, eq=False)
class ImageGoal:
    """The place to stop at, as a panorama taken there.

    Attributes:
        rgb: The panorama.
        depth_m: Its depth, where the robot has a depth camera.
    """

    rgb: UInt8[np.ndarray, "height width 3"]
    depth_m: Float32[np.ndarray, "height width"] | None = None


@dataclass(frozen=True)
class ImageNavEpisode:
    """Where an episode starts and where its goal picture was taken.

    Attributes:
        scene_suite: Suite of the building, such as `homes-test`.
        scene_seed: Seed of the building in that suite.
        start: Where the robot starts.
        goal: Where the goal's panorama was taken; its heading turns the picture, nothing else.
        geodesic_m: Length of the shortest path from the start to the goal.
        difficulty: Class of that length.
        number: Number of the episode among those of its suite and difficulty.
    """

    scene_suite: str
    scene_seed: int
    start: Pose2
    goal: Pose2
    geodesic_m: float
    difficulty: Difficulty
    number: int = 0

    def __post_init__(self) -> None:
        if self.difficulty not in DIFFICULTIES:
            raise InputError(
                f"no difficulty is called '{self.difficulty}'",
                where=f"episode {self.number}",
                remedy=did_you_mean(str(self.difficulty), DIFFICULTIES),
            )
        if not all(map(math.isfinite, (*self.start, *self.goal))) or not self.geodesic_m > 0:
            raise InputError(
                f"poses must be finite and the path longer than zero, got {self.geodesic_m} m",
                where=f"episode {self.id}",
                remedy="make the episodes again",
            )

    @property
    def id(self) -> str:
        """Its name, unique among all suites."""
        return f"{self.scene_suite}/{self.difficulty}/{self.number:04d}"


@dataclass(frozen=True)
class BeliefNode:
    """A node of the map that the agent has built: a place with its panorama.

    Attributes:
        pose: Where the agent thinks that it is, in the frame of the start.
        step: Step at which it was added.
        panorama: Its picture where it is to be shown, else None.
    """

    pose: Pose2
    step: int
    panorama: UInt8[np.ndarray, "height width 3"] | None = None


@dataclass(frozen=True)
class BeliefEdge:
    """An edge of the map that the agent has built.

    Attributes:
        source: Number of a node.
        target: Number of a node.
    """

    source: int
    target: int


@dataclass(frozen=True)
class BeliefGhost:
    """A place that the agent thinks it could explore.

    Attributes:
        node: Number of the node that it hangs on.
        pose: Where it is, in the frame of the start.
        score: How fast the goal may be reached that way, 0..1; None where not scored.
    """

    node: int
    pose: Pose2
    score: float | None = None


@dataclass(frozen=True, eq=False)
class ImageNavBelief:
    """What an agent thinks, for display alone. Every part may be missing.

    Attributes:
        pose: Where it thinks that it is, in the frame of the start.
        nodes: Nodes of its map, in the order that they were added.
        edges: Edges between them.
        ghosts: Unexplored places.
        node: Number of the node that it thinks it is in.
        goal_node: Number of the node in which it has found the goal.
        goal: Where it thinks that the goal is, in the frame of the start.
        subgoal: Where it is heading now, in the frame of the start.
        explorable: Probability that there is something to explore in each direction, from here.
        score: Score of each direction, from here.
        mode: What it is doing, in a word or two: `explore`, `approach`, `recover`, `stop`.
        stopped_because: Why it stopped by itself, or an empty string.
    """

    pose: Pose2 | None = None
    nodes: tuple[BeliefNode, ...] = ()
    edges: tuple[BeliefEdge, ...] = ()
    ghosts: tuple[BeliefGhost, ...] = ()
    node: int | None = None
    goal_node: int | None = None
    goal: Pose2 | None = None
    subgoal: Pose2 | None = None
    explorable: Float[np.ndarray, " directions"] | None = None
    score: Float[np.ndarray, " directions"] | None = None
    mode: str = ""
    stopped_because: str = ""


@runtime_checkable
class ImageNavAgent(Protocol):
    """Panoramas in, actions out. Deterministic given its seed."""

    def reset(self, goal: ImageGoal) -> None:
        """Begins an episode.

        An agent whose map may outlive a goal has a keyword `keep_map` besides, for sequential
        goals.
        """

    def act(self, observation: PanoramaObservation) -> Action:
        """The next action."""

    def belief(self) -> ImageNavBelief:
        """What it thinks after the last `act`."""


def bin_of_direction(yaw_rad: float) -> int:
    """The bin that a direction, counter-clockwise from forward, falls into.

    Example:
        >>> bin_of_direction(math.radians(-14)), bin_of_direction(math.radians(16))
        (0, 1)
    """
    width_rad = 2 * math.pi / DIRECTIONS
    return math.floor(yaw_rad / width_rad + 0.5) % DIRECTIONS


def direction_of_bin(number: int) -> float:
    """The middle of a bin, in radians counter-clockwise from forward, in [-pi, pi).

    Example:
        >>> round(math.degrees(direction_of_bin(3)), 6)
        90.0
    """
    return wrap_angle(number * 2 * math.pi / DIRECTIONS)

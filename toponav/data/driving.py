"""One recorded drive: which plan from where, who drives, and when it ends."""

import contextlib
import math
from collections import deque
from dataclasses import dataclass, field
from typing import Final, Protocol, runtime_checkable

import numpy as np

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Observation, Velocity
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2, angle_difference, wrap_angle
from toponav.core.vocabulary import NodeKind
from toponav.data.buildings import Building
from toponav.data.expert import Expert
from toponav.data.noise import NoiseConfig, VelocityNoise
from toponav.data.recording import ExtraImage
from toponav.data.storage import TrajectoryWriter
from toponav.maps.plan import Plan, shortest_plan
from toponav.maps.task import NavigationTask
from toponav.sim.oracle import TruthLocalizer
from toponav.sim.simulation import CONTROL_PERIOD_S, PhysicsError, SimState, Simulation
from toponav.worlds.free_space import FreeSpace

__all__ = [
    "Driver",
    "DriverFactory",
    "NoisyExpert",
    "NoisyExpertFactory",
    "Site",
    "StartConfig",
    "drive",
    "sample_start",
]

_TRIES: Final = 200
_CLEARANCE_M: Final = 0.3
_STUCK_STEPS, _STUCK_M, _STUCK_RAD = 50, 0.5, math.radians(20.0)


@dataclass(frozen=True)
class StartConfig:
    """Where drives begin."""

    any_yaw_fraction: float = 0.2
    """Fraction of drives that start facing anywhere, not within 20 degrees of the first edge."""
    at_node_fraction: float = 0.3
    """Fraction of drives that start at the room's node, not anywhere in the room."""
    yaw_spread_rad: float = math.radians(20.0)
    """How far from the first edge's yaw the other drives may face."""
    after_goal_steps: int = 5
    """Steps that are recorded after the goal is reached."""
    longest_of: int = 1
    """Of this many random pairs of rooms, the one with the longest plan is driven."""

    def __post_init__(self) -> None:
        if not 1 <= self.longest_of <= 1000:
            raise InputError(
                f"1..1000 pairs can be drawn, got {self.longest_of}",
                where="--longest-of",
                remedy="leave it at 1, or take 16 for drives of the paper's length",
            )
        for name in ("any_yaw_fraction", "at_node_fraction"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise InputError(
                    f"a fraction must lie in 0..1, got {getattr(self, name)}",
                    where=f"--{name.replace('_', '-')}",
                    remedy="leave it at its default",
                )


@runtime_checkable
class Driver(Protocol):
    """Who drives while a trajectory is recorded: the expert with noise, or a learner."""

    def reset(self, task: NavigationTask, random: np.random.Generator, attempt: int) -> None:
        """Begin a drive; `attempt` counts the earlier ones that missed the goal."""

    def act(
        self, observation: Observation, state: SimState, expert: Velocity, node: str | None
    ) -> Velocity:
        """The command to execute, given what the expert would do here and the true node."""


@runtime_checkable
class DriverFactory(Protocol):
    """Makes the driver inside each worker; has to survive being sent to a process."""

    def __call__(self) -> Driver:
        """A fresh driver."""

    @property
    def source(self) -> str:
        """Name under which trajectories say who drove them."""


class NoisyExpert:
    """The expert's own command with the paper's noise; half as much at each new attempt."""

    def __init__(self, noise: NoiseConfig) -> None:
        self._config = noise
        self._noise = VelocityNoise(noise)
        self._random = np.random.default_rng(0)

    def reset(self, task: NavigationTask, random: np.random.Generator, attempt: int) -> None:
        """Begin a drive without noise."""
        self._noise = VelocityNoise(self._config, 0.5**attempt)
        self._random = random

    def act(
        self, observation: Observation, state: SimState, expert: Velocity, node: str | None
    ) -> Velocity:
        """The expert's command plus noise."""
        return self._noise.apply(expert, self._random)


@dataclass(frozen=True)
class NoisyExpertFactory:
    """Makes `NoisyExpert` drivers."""

    noise: NoiseConfig = field(default_factory=NoiseConfig)
    source: str = "expert"

    def __call__(self) -> Driver:
        """A fresh driver."""
        return NoisyExpert(self.noise)


class Site:
    """A building with everything that driving in it needs, made once per worker.

    Args:
        building: Scene and map.
        camera: The depth camera.
        images: What is recorded besides depth.
    """

    def __init__(
        self, building: Building, camera: PinholeCamera, images: tuple[ExtraImage, ...] = ()
    ) -> None:
        self.building = building
        self.images = images
        self.simulation = Simulation(building.scene, camera, modalities=("depth", *images))
        self.expert = Expert(building.scene, building.map)
        self.truth = TruthLocalizer(building.map, building.scene)
        free = FreeSpace.of(building.scene, _CLEARANCE_M)
        self._free_cells = {
            room.name: np.argwhere(free.free & (building.scene.room_index == number))
            for number, room in enumerate(building.scene.rooms)
            if room.kind.is_enclosed
        }
        self.rooms = tuple(
            node.id
            for node in building.map.nodes
            if node.kind is NodeKind.ROOM
            and len(self._free_cells.get(node.room or "", ()))
            and building.map.out_edges(node.id)
        )
        if len(self.rooms) < 2:
            raise InputError(
                f"drives lead from room to room, but {len(self.rooms)} rooms have a node, an "
                "edge and free floor",
                where=f"building {building.name}",
                remedy="run `toponav map check` on its map, or leave the building out",
            )

    def random_position(self, room_node: str, random: np.random.Generator) -> tuple[float, float]:
        """A point on free floor in the node's room."""
        node = self.building.map.node(room_node)
        cells = self._free_cells[node.room or ""]
        row, col = cells[random.integers(len(cells))].tolist()
        return self.building.scene.grid.center_of(row, col)


def sample_start(
    site: Site, config: StartConfig, random: np.random.Generator
) -> tuple[Plan, Pose2]:
    """A plan between two random rooms and a pose to begin it from.

    Raises:
        InputError: No two rooms of the building are connected.
    """
    topological_map = site.building.map
    for _ in range(_TRIES):
        plan = _sample_plan(site, config.longest_of, random)
        if plan is None:
            continue
        node = topological_map.node(plan.nodes[0])
        x_m, y_m = node.x_m, node.y_m
        if random.random() >= config.at_node_fraction:
            x_m, y_m = site.random_position(node.id, random)
        yaw_rad = topological_map.edge(plan.edges[0]).yaw_rad
        if random.random() < config.any_yaw_fraction:
            yaw_rad = random.uniform(-math.pi, math.pi)
        else:
            yaw_rad += random.uniform(-config.yaw_spread_rad, config.yaw_spread_rad)
        pose = Pose2(x_m, y_m, wrap_angle(yaw_rad))
        if site.simulation.reset(pose).contact is not None:
            continue
        try:
            site.expert.reset(plan, pose)
        except InputError:
            continue
        return plan, pose
    raise InputError(
        f"{_TRIES} random pairs of rooms gave no drive: no plan, or no way on the floor",
        where=f"building {site.building.name}",
        remedy="run `toponav map check` on its map, or leave the building out",
    )


def _sample_plan(site: Site, draws: int, random: np.random.Generator) -> Plan | None:
    """The longest of the plans between some random pairs of rooms; None where none has one."""
    plans = []
    for _ in range(draws):
        first, second = random.choice(len(site.rooms), 2, replace=False).tolist()
        with contextlib.suppress(InputError):
            plans.append(shortest_plan(site.building.map, site.rooms[first], site.rooms[second]))
    return max(plans, key=lambda plan: plan.length_m(site.building.map), default=None)


def drive(
    site: Site,
    plan: Plan,
    start: Pose2,
    driver: Driver,
    writer: TrajectoryWriter,
    after_goal_steps: int = 5,
) -> tuple[str, str]:
    """Record one drive; returns how it ended and what it touched.

    Each frame holds what the robot sees, the expert's command there (the label) and the
    driver's command, which is executed until the next frame. The drive ends a second after
    the true node is the goal; at contact, when stuck, at three times the nominal time, or
    where the expert finds no way.
    """
    simulation, expert = site.simulation, site.expert
    state = simulation.reset(start)
    expert.reset(plan, start)
    steps_left = _most_steps(site.building, plan)
    recent: deque[Pose2] = deque(maxlen=_STUCK_STEPS)
    outcome = "timeout"
    while steps_left > 0:
        observation = simulation.observe()
        try:
            command = expert.act(state.pose, state.velocity)
        except InputError:
            return "stuck", ""
        node = site.truth.node_at(state.pose)
        executed = simulation.limits.clip(driver.act(observation, state, command, node))
        images = {name: getattr(observation, name) for name in site.images}
        writer.append(observation.depth_m, state.pose, state.velocity, command, executed, images)
        if outcome != "success" and node == plan.nodes[-1]:
            outcome, steps_left = "success", min(steps_left, after_goal_steps + 1)
        try:
            state = simulation.step(executed)
        except PhysicsError:
            return "stuck", ""
        if state.contact is not None:
            return ("collided" if outcome != "success" else outcome), state.contact
        if outcome != "success" and _is_stuck(recent, state.pose):
            return "stuck", ""
        steps_left -= 1
    return outcome, ""


def _most_steps(building: Building, plan: Plan) -> int:
    """Three times what a steady driver needs: 0.5 m/s, two seconds a node, a turn at the start."""
    nominal_s = plan.length_m(building.map) / 0.5 + 2.0 * len(plan.nodes) + 5.0
    return math.ceil(3.0 * nominal_s / CONTROL_PERIOD_S)


def _is_stuck(recent: deque[Pose2], pose: Pose2) -> bool:
    full = len(recent) == _STUCK_STEPS
    oldest = recent[0] if recent else pose
    recent.append(pose)
    return (
        full
        and pose.distance_to(oldest) < _STUCK_M
        and abs(angle_difference(pose.yaw_rad, oldest.yaw_rad)) < _STUCK_RAD
    )

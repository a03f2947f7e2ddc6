"""PhaseNet's agent: executes the plan's behaviours one after the other, each until it is done."""

import math

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Belief, Observation, Velocity
from toponav.maps.task import NavigationTask
from toponav.models.baselines.phasenet import PhaseNet, PhaseState
from toponav.models.checkpoints import load_phasenet, load_weights
from toponav.navigation.baselines.driver import driver_for
from toponav.navigation.graphnav.driver import BehaviorDriver

__all__ = ["PhaseNetAgent", "load_phasenet_agent"]

_STOP = Velocity(0.0, 0.0)


class PhaseNetAgent:
    """Drives a plan from depth images and the plan's behaviours; it never looks at the map.

    Each step the network says how much of the present behaviour is done. At `finished_at` the
    plan's next behaviour begins and the network starts afresh, so a switch made too early or
    too late is never made good. The last behaviour goes on until the episode ends.

    Args:
        network: Predicts the phase.
        driver: Runs the behaviour networks and keeps the frames.

    Reference:
        GraphNav, section VII, "PhaseNet".
    """

    def __init__(self, network: PhaseNet, driver: BehaviorDriver) -> None:
        self._network = network.eval()
        self._driver = driver
        self._task: NavigationTask | None = None
        self._state: PhaseState | None = None
        self._position = 0
        self._belief = Belief()

    def reseed(self, seed: int) -> None:
        """Nothing here is random."""

    def reset(self, task: NavigationTask) -> None:
        """Begin the plan's first behaviour."""
        self._task = task
        self._behaviors = task.plan.behaviors(task.map)
        assert self._behaviors, "a plan needs at least one edge to have a behaviour"
        self._driver.reset()
        self._state, self._position = None, 0
        self._believe("")

    def act(self, observation: Observation) -> Velocity:
        """The command for this step; zero when the frame cannot be trusted."""
        assert self._task is not None, "reset the agent first"
        if not self._driver.observe(observation):
            self._believe(self._driver.stopped_because)
            return _STOP
        frames = self._driver.stack(self._network.config.frame_offsets)
        executed = self._behaviors[self._position]
        phase, self._state = self._network.act(frames, executed, self._state)
        if not math.isfinite(phase):
            self._state = None
            self._believe("PhaseNet gave a phase that is not finite")
            return _STOP
        is_last = self._position + 1 == len(self._behaviors)
        if phase >= self._network.config.finished_at and not is_last:
            self._position += 1
            self._state = None
        command = self._driver.command(self._behaviors[self._position])
        self._believe(self._driver.stopped_because)
        return command

    def belief(self) -> Belief:
        """The node and edge of the plan whose behaviour it is executing."""
        return self._belief

    def _believe(self, stopped_because: str) -> None:
        assert self._task is not None
        plan, position = self._task.plan, self._position
        self._belief = Belief(
            plan.nodes[position],
            plan.edges[position],
            self._behaviors[position],
            stopped_because=stopped_because,
        )


def load_phasenet_agent(weights: str | None, *, camera: PinholeCamera) -> PhaseNetAgent:
    """PhaseNet with the networks of a folder, or of a preset that ships with the package.

    Args:
        weights: A folder of checkpoints, the name of a shipped preset, or None for `compact`.
        camera: The camera that the robot carries.

    Raises:
        InputError: The weights cannot be read, hold no PhaseNet, or the camera does not suit
            them.

    Example:
        >>> agent = load_phasenet_agent(None, camera=PinholeCamera())  # doctest: +SKIP
    """
    name = weights or "compact"
    network = load_phasenet(name)
    return PhaseNetAgent(network, driver_for(network, load_weights(name).behaviors, camera))

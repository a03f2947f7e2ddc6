"""BehavRNN's agent: a network that read the plan says at each step what to do."""

import numpy as np

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Belief, Observation, Velocity
from toponav.core.vocabulary import Behavior
from toponav.maps.task import NavigationTask
from toponav.models.baselines.behavrnn import BehavRNN, DecoderState
from toponav.models.checkpoints import load_behavrnn, load_weights
from toponav.navigation.baselines.driver import driver_for
from toponav.navigation.graphnav.driver import BehaviorDriver

__all__ = ["BehavRNNAgent", "load_behavrnn_agent"]

_STOP = Velocity(0.0, 0.0)
_ORDER = tuple(Behavior)


class BehavRNNAgent:
    """Drives a plan from depth images and the plan's behaviours; it never looks at the map.

    The network reads the plan once, then names the likeliest of the five behaviours every
    `stride` steps, whether or not the plan has it there. It does not say where it is: its
    belief has a behaviour and no node.

    Args:
        network: Decides which behaviour to execute.
        driver: Runs the behaviour networks and keeps the frames.

    Reference:
        GraphNav, section VII, "BehavRNN".
    """

    def __init__(self, network: BehavRNN, driver: BehaviorDriver) -> None:
        self._network = network.eval()
        self._driver = driver
        self._state: DecoderState | None = None
        self._step = 0
        self._behavior = _ORDER[0]
        self._belief = Belief()

    def reseed(self, seed: int) -> None:
        """Nothing here is random."""

    def reset(self, task: NavigationTask) -> None:
        """Read the plan."""
        behaviors = task.plan.behaviors(task.map)
        assert behaviors, "a plan needs at least one edge to have a behaviour"
        self._driver.reset()
        self._state = self._network.start(behaviors)
        self._step, self._behavior = 0, behaviors[0]
        self._belief = Belief(behavior=self._behavior)

    def act(self, observation: Observation) -> Velocity:
        """The command for this step; zero when the frame cannot be trusted."""
        assert self._state is not None, "reset the agent first"
        if not self._driver.observe(observation):
            return self._stop(self._driver.stopped_because)
        if self._step % self._network.config.stride == 0:
            frames = self._driver.stack(self._network.config.frame_offsets)
            probability, state = self._network.act(frames, self._state)
            if not np.isfinite(probability).all():
                return self._stop("BehavRNN gave probabilities that are not finite")
            self._state = state
            self._behavior = _ORDER[int(probability.argmax())]
        self._step += 1
        command = self._driver.command(self._behavior)
        self._belief = Belief(
            behavior=self._behavior, stopped_because=self._driver.stopped_because
        )
        return command

    def belief(self) -> Belief:
        """The behaviour it is executing."""
        return self._belief

    def _stop(self, because: str) -> Velocity:
        self._belief = Belief(behavior=self._behavior, stopped_because=because)
        return _STOP


def load_behavrnn_agent(weights: str | None, *, camera: PinholeCamera) -> BehavRNNAgent:
    """BehavRNN with the networks of a folder, or of a preset that ships with the package.

    Args:
        weights: A folder of checkpoints, the name of a shipped preset, or None for `compact`.
        camera: The camera that the robot carries.

    Raises:
        InputError: The weights cannot be read, hold no BehavRNN, or the camera does not suit
            them.

    Example:
        >>> agent = load_behavrnn_agent(None, camera=PinholeCamera())  # doctest: +SKIP
    """
    name = weights or "compact"
    network = load_behavrnn(name)
    return BehavRNNAgent(network, driver_for(network, load_weights(name).behaviors, camera))

"""Executes behaviours: depth frames in, the velocity of the behaviour's network out."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import UInt8

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Observation, Velocity
from toponav.core.vocabulary import Behavior
from toponav.models.checkpoints import load_weights
from toponav.models.graphnav.behavior import BehaviorNetwork, BehaviorState
from toponav.models.graphnav.preprocess import DepthResampler, FrameHistory
from toponav.navigation.graphnav.depth_guard import DepthGuard

__all__ = ["BehaviorDriver", "load_driver"]

_STOP = Velocity(0.0, 0.0)


class BehaviorDriver:
    """Runs one behaviour network at a time and forgets its state when the behaviour changes.

    A depth frame that cannot be trusted (NaN, infinite, all zero, frozen, wrong size or type)
    is not shown to any network: the robot stops and `stopped_because` says why. It goes on
    with the first frame that can be trusted.

    Args:
        networks: A trained network for each behaviour; all see the same kind of image.
        camera: The camera that takes the frames.
        history: Frames to remember; what the networks ask for when None.
    """

    def __init__(
        self,
        networks: Mapping[Behavior, BehaviorNetwork],
        camera: PinholeCamera,
        history: int | None = None,
    ) -> None:
        self._networks = {behavior: network.eval() for behavior, network in networks.items()}
        config = next(iter(self._networks.values())).config
        needed = max(max(net.config.frame_offsets) for net in self._networks.values()) + 1
        self._guard = DepthGuard(camera)
        self._last_command = _STOP
        self._resample = DepthResampler(camera, config)
        self._frames = FrameHistory(max(needed, history or 0), config.image)
        self._behavior: Behavior | None = None
        self._state: BehaviorState | None = None
        self.stopped_because = ""

    def reset(self) -> None:
        """Forget the frames seen so far and the behaviour executed."""
        self._frames.clear()
        self._behavior, self._state = None, None
        self._guard.reset()
        self._last_command = _STOP
        self.stopped_because = ""

    def observe(self, observation: Observation) -> bool:
        """Take in a frame; False, with `stopped_because` set, when it cannot be trusted."""
        self.stopped_because = self._guard.fault(observation.depth_m, self._last_command)
        self._last_command = _STOP
        if self.stopped_because:
            return False
        self._frames.push(self._resample(observation.depth_m))
        return True

    def stack(self, frame_offsets: tuple[int, ...]) -> UInt8[np.ndarray, "frames rows cols"]:
        """The frames these many steps before now, for another network that sees the same."""
        return self._frames.stack(frame_offsets)

    def command(self, behavior: Behavior) -> Velocity:
        """The velocity of the behaviour's network on the frames observed so far."""
        if behavior is not self._behavior:
            self._behavior, self._state = behavior, None
        network = self._networks[behavior]
        frames = self._frames.stack(network.config.frame_offsets)
        velocity, self._state = network.act(frames, self._state)
        if not (np.isfinite(velocity.linear_m_s) and np.isfinite(velocity.angular_rad_s)):
            self.stopped_because = f"the {behavior} network gave a velocity that is not finite"
            self._state = None
            return _STOP
        self._last_command = velocity
        return velocity

    def drive(self, behavior: Behavior, observation: Observation) -> Velocity:
        """Observe, then command; a stop when the frame cannot be trusted."""
        return self.command(behavior) if self.observe(observation) else _STOP


def load_driver(weights: str | None, *, camera: PinholeCamera) -> BehaviorDriver:
    """A driver with the networks of a folder, or of a preset that ships with the package.

    Args:
        weights: A folder of checkpoints, the name of a shipped preset, or None for `compact`.
        camera: The camera that the robot carries.

    Raises:
        InputError: The weights cannot be read, or the camera does not suit them.
    """
    return BehaviorDriver(load_weights(weights or "compact").behaviors, camera)

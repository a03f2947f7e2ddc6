"""The driver that a baseline shares with GraphNav."""

from collections.abc import Mapping

from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior
from toponav.models.baselines.behavrnn import BehavRNN
from toponav.models.baselines.phasenet import PhaseNet
from toponav.models.graphnav.behavior import BehaviorNetwork
from toponav.navigation.graphnav.driver import BehaviorDriver

__all__ = ["driver_for"]


def driver_for(
    network: PhaseNet | BehavRNN,
    behaviors: Mapping[Behavior, BehaviorNetwork],
    camera: PinholeCamera,
) -> BehaviorDriver:
    """A driver that keeps enough frames for the network that chooses behaviours.

    Raises:
        InputError: The network does not see what the behaviour networks see.
    """
    if any(one.config.image != network.config.image for one in behaviors.values()):
        raise InputError(
            f"{network.kind} sees another image than the behaviour networks beside it",
            where="--weights",
            remedy="train both with the same --preset",
        )
    return BehaviorDriver(behaviors, camera, history=network.config.frame_offsets[0] + 1)

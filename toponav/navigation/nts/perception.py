"""What the agent makes of a panorama, computed once for each."""

import math
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Float32, UInt8
from torch import Tensor

from toponav.core.imagenav import DIRECTIONS, PANORAMA_SHAPE
from toponav.models.nts.encoder import folded
from toponav.models.nts.network import NTSNetwork
from toponav.models.nts.panorama import network_input
from toponav.navigation.nts.registration import Signature, signature

__all__ = ["PairView", "Perception", "View", "fault_of"]


@dataclass(frozen=True, eq=False)
class View:
    """A panorama as the agent sees it.

    Attributes:
        features: For the network's pairs.
        explorable: F_G, probability of each direction.
        obstacle_m: Predicted ranges to obstacles.
        sight_m: Predicted ranges of level sight.
        signature: For registration.
    """

    features: Float[Tensor, "1 features azimuths"]
    explorable: Float32[np.ndarray, " directions"]
    obstacle_m: Float32[np.ndarray, " ranges"]
    sight_m: Float32[np.ndarray, " ranges"]
    signature: Signature


@dataclass(frozen=True, eq=False)
class PairView:
    """What sources and one goal say together.

    Attributes:
        connection: F_L, probability of one node, per source.
        direction_rad: F_R, direction of the goal from each source.
        distance_m: F_R, distance from each source.
        score: F_S, per source and direction.
    """

    connection: Float32[np.ndarray, " sources"]
    direction_rad: Float32[np.ndarray, " sources"]
    distance_m: Float32[np.ndarray, " sources"]
    score: Float32[np.ndarray, "sources directions"]


class Perception:
    """The network's four functions, with features kept.

    Args:
        network: Colour, or colour and depth.
    """

    def __init__(self, network: NTSNetwork) -> None:
        self.network: NTSNetwork = folded(network)  # type: ignore[assignment]

    @property
    def depth(self) -> bool:
        """Whether it asks for depth."""
        return self.network.config.depth

    @torch.inference_mode()
    def see(
        self,
        rgb: UInt8[np.ndarray, "height width 3"],
        depth_m: Float32[np.ndarray, "height width"] | None,
    ) -> View:
        """What one panorama says alone."""
        seen = network_input(rgb, depth_m, self.network.config)
        features = self.network.encode(torch.from_numpy(seen)[None])
        place = self.network.place(features)
        sight_m = place.sight_m[0].float().numpy()
        return View(
            features,
            torch.sigmoid(place.explorable[0]).float().numpy(),
            place.obstacle_m[0].float().numpy(),
            sight_m,
            signature(rgb, depth_m if self.depth else None, sight_m),
        )

    @torch.inference_mode()
    def compare(self, sources: list[View], goal: View) -> PairView:
        """What some views and a goal say together."""
        one = torch.cat([view.features for view in sources])
        pair = self.network.pair(one, goal.features.expand(len(one), -1, -1))
        chances = torch.softmax(pair.direction.float(), dim=1).numpy()
        angles = np.arange(DIRECTIONS) * (2 * math.pi / DIRECTIONS)
        direction = np.arctan2(chances @ np.sin(angles), chances @ np.cos(angles))
        return PairView(
            torch.sigmoid(pair.connection.float()).numpy(),
            direction.astype(np.float32),
            pair.distance_m.float().numpy(),
            torch.sigmoid(pair.score.float()).numpy(),
        )


def fault_of(rgb: np.ndarray | None, depth_m: np.ndarray | None, *, wants_depth: bool) -> str:
    """What is wrong with a panorama; empty where nothing is."""
    height, width = PANORAMA_SHAPE
    if rgb is None or rgb.shape != (height, width, 3) or rgb.dtype != np.uint8:
        shape = None if rgb is None else rgb.shape
        return f"the picture has to be {height}x{width} RGB bytes, got {shape}"
    if int(rgb.max()) - int(rgb.min()) < 8:
        return "the picture shows nothing"
    if wants_depth:
        if depth_m is None or depth_m.shape != (height, width):
            return f"depth has to be {height}x{width} metres"
        if not np.isfinite(depth_m).all() or not (depth_m > 0).any():
            return "the depth camera sees nothing"
    return ""

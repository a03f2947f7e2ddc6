"""The multi-task network: from two panoramas to connection, relative pose, exploration, score."""

from typing import ClassVar

from jaxtyping import Float, Int64, UInt8
from torch import Tensor, nn

from toponav.models.nts.encoder import AroundEncoder, ResNet18Encoder
from toponav.models.nts.heads import AroundHeads, ConnectedHeads, PairPrediction, PlacePrediction
from toponav.models.nts.presets import NTSConfig

__all__ = ["NTSNetwork", "PairPrediction", "PlacePrediction"]


class NTSNetwork(nn.Module):
    """One shared encoder and the heads of section 4.2.

    Features of a panorama are computed once and kept; pairs are compared by their features.

    Args:
        config: Sizes.

    Reference:
        Chaplot et al. 2020, figure 7.
    """

    kind: ClassVar[str] = "nts"

    def __init__(self, config: NTSConfig) -> None:
        super().__init__()
        self.config = config
        is_around = config.encoder == "around"
        self.encoder = AroundEncoder(config) if is_around else ResNet18Encoder(config)
        self.heads: nn.Module = AroundHeads(config) if is_around else ConnectedHeads(config)

    def encode(
        self, images: UInt8[Tensor, "batch channels rows cols"]
    ) -> Float[Tensor, "batch features azimuths"]:
        """Features of panoramas, as `network_input` makes them."""
        out: Tensor = self.encoder((images.float() - 110.0) / 64.0)
        return out

    def place(self, features: Float[Tensor, "places features azimuths"]) -> PlacePrediction:
        """What panoramas say alone."""
        found: PlacePrediction = self.heads.place(features)  # type: ignore[operator]
        return found

    def scores(
        self,
        features: Float[Tensor, "places features azimuths"],
        source: Int64[Tensor, " pairs"],
        goal: Int64[Tensor, " pairs"],
    ) -> Float[Tensor, "pairs directions"]:
        """F_S of many pairs among some panoramas, by a short cut where the heads have one."""
        found: Tensor = self.heads.scores(features, source, goal)  # type: ignore[operator]
        return found

    def pair(
        self,
        source: Float[Tensor, "pairs features azimuths"],
        goal: Float[Tensor, "pairs features azimuths"],
    ) -> PairPrediction:
        """What sources and goals say together."""
        found: PairPrediction = self.heads(source, goal)
        return found

    def forward(self, source: Tensor, goal: Tensor) -> tuple[PairPrediction, PlacePrediction]:
        """Both predictions from images."""
        features = self.encode(source)
        return self.pair(features, self.encode(goal)), self.place(features)

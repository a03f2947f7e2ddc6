"""The graph localization network: which edge of the map is the robot on?"""

import numpy as np
import torch
from jaxtyping import Float, Float32, Int64, UInt8
from torch import Tensor, nn
from torch.nn import functional as F

from toponav.core.vocabulary import Behavior
from toponav.models.graphnav.encoder import DepthEncoder
from toponav.models.graphnav.gn_block import gn_block
from toponav.models.graphnav.graph_tensors import (
    GraphBatch,
    GraphTensors,
    batch_graphs,
    edge_feature_count,
)
from toponav.models.graphnav.presets import LocalizationConfig

__all__ = ["LocalizationNetwork", "edge_log_probabilities"]


class LocalizationNetwork(nn.Module):
    """A depth stack becomes the global feature of a cropped map; edges become logits.

    Preset `paper` is section V-C and appendix A-A: node and edge embeddings of 512 (three node
    kinds, a door node being its room's; five behaviours), a visual feature of 512 with the
    tanh that the authors' code has and the paper leaves open, and two GN blocks whose update
    functions are table III. The last block's fourth layer has one output: the logit.

    Args:
        config: Sizes; its `image` and `frame_offsets` say what to show it.

    Reference:
        Chen et al. 2019, section V-C, figure 4, tables II and III.
    """

    kind = "localization"

    def __init__(self, config: LocalizationConfig) -> None:
        super().__init__()
        self.config = config
        self.encoder = DepthEncoder(config.encoder, config.image, len(config.frame_offsets))
        self.node_embedding = nn.Embedding(config.node_kinds, config.embedding)
        self.edge_embedding = nn.Embedding(len(Behavior), config.embedding)
        extra = edge_feature_count(config)
        first, later = config.embedding, config.width
        blocks = [
            gn_block(
                node_width=later if number else first,
                edge_width=later if number else first + extra,
                global_width=later if number else self.encoder.features,
                hidden=config.hidden,
                width=config.width,
                norm=config.norm,
                is_last=number == config.blocks - 1,
            )
            for number in range(config.blocks)
        ]
        self.blocks = nn.ModuleList(blocks)

    def forward(
        self,
        frames: UInt8[Tensor, "graphs frames rows cols"]
        | Float[Tensor, "graphs frames rows cols"],
        graphs: GraphBatch,
    ) -> Float[Tensor, " edges"]:
        """A logit for each edge; they compete within their graph."""
        u = self.visual_features(frames)
        x = self.node_embedding(graphs.node_kind)
        edge_attr = torch.cat([self.edge_embedding(graphs.edge_kind), graphs.edge_attr], dim=1)
        for block in self.blocks:
            x, edge_attr, u = block(x, graphs.edge_index, edge_attr, u, graphs.batch)
        logits: Tensor = edge_attr[:, 0]
        return logits

    def visual_features(
        self,
        frames: UInt8[Tensor, "graphs frames rows cols"]
        | Float[Tensor, "graphs frames rows cols"],
    ) -> Float[Tensor, "graphs features"]:
        """The global feature of each stack."""
        features: Tensor = self.encoder(frames)
        return features if self.config.encoder.features else torch.tanh(features)

    @torch.inference_mode()
    def edge_probabilities(
        self, frames: UInt8[np.ndarray, "frames rows cols"], graph: GraphTensors
    ) -> Float32[np.ndarray, " edges"]:
        """The probability of each edge of one crop, in the order of `graph.edge_ids`."""
        assert not self.training, "call eval() before driving"
        logits = self(torch.from_numpy(frames)[None], batch_graphs([graph]))
        probabilities: np.ndarray = torch.softmax(logits.float(), 0).numpy()
        return probabilities


def edge_log_probabilities(
    logits: Float[Tensor, " edges"], graphs: GraphBatch
) -> Float[Tensor, "graphs most_edges"]:
    """Log-probabilities with a row a graph; rows with fewer edges end in minus infinity.

    The k-th edge of a graph is in column k.
    """
    counts = torch.bincount(graphs.edge_batch, minlength=graphs.graphs)
    first = torch.cumsum(counts, 0) - counts
    column: Int64[Tensor, " edges"] = torch.arange(len(logits)) - first[graphs.edge_batch]
    table = logits.new_full((graphs.graphs, int(counts.max())), float("-inf"), dtype=torch.float32)
    table[graphs.edge_batch, column] = logits.float()
    return F.log_softmax(table, dim=1)

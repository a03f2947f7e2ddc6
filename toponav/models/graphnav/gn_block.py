"""Graph network blocks (algorithm 1) as update functions of PyTorch Geometric's MetaLayer."""

import itertools
from typing import Literal

import torch
from jaxtyping import Float, Int64
from torch import Tensor, nn
from torch.nn import functional as F
from torch_geometric.nn import MetaLayer

__all__ = ["gn_block"]

_Norm = Literal["batch", "layer"]


def gn_block(
    *,
    node_width: int,
    edge_width: int,
    global_width: int,
    hidden: tuple[int, ...],
    width: int,
    norm: _Norm,
    is_last: bool = False,
) -> nn.Module:
    """A block that updates edges, then nodes, then the global feature, with sums between.

    The last block's edges are the answer, one logit each; what would only feed a further
    block is left out of it, since no gradient would ever reach it.

    Args:
        node_width: Width of the node features that come in.
        edge_width: Width of the edge features that come in.
        global_width: Width of the global feature that comes in.
        hidden: Hidden widths of the update functions.
        width: Width of the features that go out.
        norm: What follows each hidden layer.
        is_last: Whether edges leave as one logit each.

    Reference:
        Chen et al. 2019, algorithm 1 and table III; Battaglia et al. 2018.
    """
    edge_out = 1 if is_last else width
    edge_in = 2 * node_width + edge_width + global_width
    edge_model = _EdgeUpdate(edge_in, hidden, edge_out, norm)
    if is_last:
        block: nn.Module = MetaLayer(edge_model, None, None)
        return block
    block = MetaLayer(
        edge_model,
        _NodeUpdate(width + node_width + global_width, hidden, width, norm),
        _GlobalUpdate(width + width + global_width, hidden, width, norm),
    )
    return block


class _Update(nn.Module):
    """A multi-layer perceptron whose first layer takes several inputs side by side.

    The first layer's product is the sum of its inputs' products, so an input that many rows
    share (the global feature) is multiplied once and then spread.
    """

    def __init__(self, inputs: int, hidden: tuple[int, ...], outputs: int, norm: _Norm) -> None:
        super().__init__()
        kind = nn.BatchNorm1d if norm == "batch" else nn.LayerNorm
        self.first = nn.Linear(inputs, hidden[0])
        layers: list[nn.Module] = [kind(hidden[0]), nn.ReLU(inplace=True)]
        widths = [*hidden, outputs]
        for before, after in itertools.pairwise(widths[:-1]):
            layers += [nn.Linear(before, after), kind(after), nn.ReLU(inplace=True)]
        layers.append(nn.Linear(widths[-2], outputs))
        self.rest = nn.Sequential(*layers)

    def spread_global(self, u: Tensor, batch: Tensor | None) -> Tensor:
        """What the global feature, the first layer's last input, adds to each row."""
        part = F.linear(u, self.first.weight[:, -u.shape[1] :], self.first.bias)
        return part if batch is None else part.index_select(0, batch)

    def finish(self, own: Tensor, shared: Tensor) -> Tensor:
        """The output for rows with inputs of their own and a part from the global feature."""
        product = F.linear(own, self.first.weight[:, : own.shape[1]])
        result: Tensor = self.rest(product + shared)
        return result


class _EdgeUpdate(_Update):
    def forward(
        self,
        source: Float[Tensor, "edges node_width"],
        target: Float[Tensor, "edges node_width"],
        edge_attr: Float[Tensor, "edges edge_width"],
        u: Float[Tensor, "graphs global_width"],
        batch: Int64[Tensor, " edges"],
    ) -> Float[Tensor, "edges outputs"]:
        """New edge features."""
        own = torch.cat([source, target, edge_attr], dim=1)
        return self.finish(own, self.spread_global(u, batch))


class _NodeUpdate(_Update):
    def forward(
        self,
        x: Float[Tensor, "nodes node_width"],
        edge_index: Int64[Tensor, "2 edges"],
        edge_attr: Float[Tensor, "edges edge_width"],
        u: Float[Tensor, "graphs global_width"],
        batch: Int64[Tensor, " nodes"],
    ) -> Float[Tensor, "nodes outputs"]:
        """New node features, from the sum of the new features of the edges that come in."""
        incoming = _sum_rows(edge_attr, edge_index[1], x.shape[0])
        own = torch.cat([incoming, x.to(incoming.dtype)], dim=1)
        return self.finish(own, self.spread_global(u, batch))


class _GlobalUpdate(_Update):
    def forward(
        self,
        x: Float[Tensor, "nodes node_width"],
        edge_index: Int64[Tensor, "2 edges"],
        edge_attr: Float[Tensor, "edges edge_width"],
        u: Float[Tensor, "graphs global_width"],
        batch: Int64[Tensor, " nodes"],
    ) -> Float[Tensor, "graphs outputs"]:
        """A new global feature, from the sums of the new edge and node features."""
        graphs = u.shape[0]
        edges = _sum_rows(edge_attr, batch.index_select(0, edge_index[0]), graphs)
        nodes = _sum_rows(x, batch, graphs)
        return self.finish(torch.cat([edges, nodes], dim=1), self.spread_global(u, None))


def _sum_rows(
    rows: Float[Tensor, "rows width"], group: Int64[Tensor, " rows"], groups: int
) -> Float[Tensor, "groups width"]:
    return rows.new_zeros(groups, rows.shape[1]).index_add_(0, group, rows)

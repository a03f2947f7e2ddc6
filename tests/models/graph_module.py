"""One helper that checks what every graph network has to hold."""

import copy
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from toponav.models.checkpoints import load_checkpoint, save_checkpoint
from toponav.models.graphnav.graph_tensors import GraphTensors, batch_graphs

__all__ = ["assert_graph_module", "permuted"]


def permuted(graph: GraphTensors, nodes: np.ndarray, edges: np.ndarray) -> GraphTensors:
    """The same graph with its nodes and edges in another order."""
    new_row = np.argsort(nodes)
    return GraphTensors(
        graph.node_kind[nodes],
        new_row[graph.edge_index][:, edges],
        graph.edge_kind[edges],
        graph.edge_attr[edges],
        tuple(graph.edge_ids[edge] for edge in edges),
    )


def assert_graph_module(
    model: torch.nn.Module,
    graphs: list[GraphTensors],
    frames: torch.Tensor,
    path: Path,
    backward: Callable[[torch.Tensor], None] = lambda out: (out**2).sum().backward(),
) -> None:
    """Permutations carry through, batches are the sum of their parts, gradients reach
    every parameter, and a checkpoint gives the same answers."""
    assert len(graphs) >= 2
    model = copy.deepcopy(model).eval()
    rng = np.random.default_rng(0)
    with torch.no_grad():
        together = model(frames, batch_graphs(graphs))
        alone = [model(frames[i : i + 1], batch_graphs([graph])) for i, graph in enumerate(graphs)]
        torch.testing.assert_close(together, torch.cat(alone), rtol=1e-4, atol=1e-4)
        for number, graph in enumerate(graphs):
            nodes = rng.permutation(len(graph.node_kind))
            edges = rng.permutation(len(graph.edge_kind))
            shuffled = batch_graphs([permuted(graph, nodes, edges)])
            answer = model(frames[number : number + 1], shuffled)
            expected = alone[number][torch.from_numpy(edges)]
            torch.testing.assert_close(answer, expected, rtol=1e-4, atol=1e-4)
        save_checkpoint(model, path)
        loaded = load_checkpoint(path)
        torch.testing.assert_close(loaded(frames, batch_graphs(graphs)), together)
    model.train()
    model.zero_grad()
    backward(model(frames, batch_graphs(graphs)))
    for name, parameter in model.named_parameters():
        assert parameter.grad is not None, f"no gradient reaches {name}"
        assert parameter.grad.abs().sum() > 0, f"the gradient of {name} is zero"

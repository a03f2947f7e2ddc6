import dataclasses

import numpy as np
import pytest
import torch

from tests.models.graph_module import assert_graph_module
from tests.models.graphs import crops, random_stacks
from toponav.core.episode import VelocityLimits
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior
from toponav.models.graphnav.behavior import BehaviorNetwork
from toponav.models.graphnav.encoder import DepthEncoder, encoder_output_shape
from toponav.models.graphnav.gn_block import gn_block
from toponav.models.graphnav.graph_tensors import batch_graphs
from toponav.models.graphnav.localization import LocalizationNetwork, edge_log_probabilities
from toponav.models.graphnav.presets import (
    Convolution,
    EncoderConfig,
    ImageSpec,
    VelocityHeadConfig,
    get_preset,
)
from toponav.models.graphnav.velocity_head import VelocityHead

PAPER, COMPACT = get_preset("paper"), get_preset("compact")


def _thin_paper():
    """The paper's localization network with a small camera, so that tests are quick."""
    encoder = EncoderConfig(
        (Convolution(8, (5, 5)), Convolution(16, (3, 3)), Convolution(16, (4, 6), 1, False))
    )
    image = ImageSpec(24, 32, "pinhole")
    return dataclasses.replace(PAPER.localization, encoder=encoder, image=image)


def test_paper_convolutions_end_at_one_pixel():
    assert encoder_output_shape(PAPER.localization.encoder, PAPER.image) == (512, 1, 1)
    turned = dataclasses.replace(PAPER.image, rows=320, cols=240)
    with pytest.raises(InputError, match="convolution 7"):
        encoder_output_shape(PAPER.localization.encoder, turned)


def test_paper_networks_have_the_tables_sizes():
    convolutions = [
        (c.channels, c.kernel, c.stride, c.norm) for c in PAPER.localization.encoder.convolutions
    ]
    assert convolutions == [
        (32, (5, 5), 2, True),
        (64, (5, 5), 2, True),
        (128, (3, 3), 2, True),
        (256, (3, 3), 2, True),
        (512, (3, 3), 2, True),
        (512, (3, 3), 2, True),
        (512, (2, 3), 1, False),
    ]
    with torch.device("meta"):
        localization = LocalizationNetwork(PAPER.localization)
        follow = BehaviorNetwork(PAPER.behavior(Behavior.CORRIDOR_FOLLOW))
        turn = BehaviorNetwork(PAPER.behavior(Behavior.TURN_LEFT))
    assert localization.node_embedding.weight.shape == (3, 512)
    assert localization.edge_embedding.weight.shape == (5, 512)
    edge_update = localization.blocks[0].edge_model
    assert edge_update.first.weight.shape == (256, 4 * 512)
    assert [type(layer).__name__ for layer in edge_update.rest] == (
        ["BatchNorm1d", "ReLU", "Linear"] * 3
    )
    assert follow.encoder.convolutions[-1].weight.shape == (2, 512, 2, 3)
    assert not follow.is_recurrent
    assert (turn.memory.num_layers, turn.memory.hidden_size) == (2, 512)
    assert turn.encoder.convolutions[0].weight.shape == (32, 1, 5, 5)


def test_paper_behaviors_give_bounded_velocities_and_carry_state():
    follow = BehaviorNetwork(PAPER.behavior(Behavior.FIND_DOOR)).eval()
    stack = random_stacks(follow.config, 1)
    command, _ = follow.act(stack[0].numpy())
    assert abs(command.linear_m_s) <= 0.5
    assert abs(command.angular_rad_s) <= 1.5
    turn = BehaviorNetwork(PAPER.behavior(Behavior.STRAIGHT)).eval()
    frame = random_stacks(turn.config, 1)
    with torch.no_grad():
        first, state = turn(frame)
        second, _ = turn(frame, state)
        afresh, _ = turn(frame)
        sequence = turn.head.velocity(turn.raw_sequence(torch.stack([frame, frame]))[1])
    assert not torch.allclose(first, second)
    torch.testing.assert_close(first, afresh)
    torch.testing.assert_close(second, sequence)


@pytest.mark.parametrize("config", [COMPACT.localization, _thin_paper()], ids=["compact", "paper"])
def test_localization_is_a_proper_graph_network(config, tmp_path):
    torch.manual_seed(0)
    model = LocalizationNetwork(config)
    graphs = crops(config)
    assert_graph_module(model, graphs, random_stacks(config, len(graphs)), tmp_path / "net")


def test_edge_probabilities_compete_within_each_graph():
    graphs = batch_graphs(crops(COMPACT.localization))
    logits = torch.randn(len(graphs.edge_kind))
    table = edge_log_probabilities(logits, graphs)
    torch.testing.assert_close(table.exp().sum(1), torch.ones(graphs.graphs))
    first = logits[graphs.edge_batch == 1]
    torch.testing.assert_close(table[1, : len(first)].exp(), torch.softmax(first, 0))


def test_block_follows_algorithm_1():
    torch.manual_seed(0)
    block = gn_block(
        node_width=3, edge_width=2, global_width=4, hidden=(5,), width=6, norm="layer"
    ).eval()
    x, e, u = torch.randn(4, 3), torch.randn(3, 2), torch.randn(2, 4)
    index = torch.tensor([[0, 1, 2], [1, 1, 3]])
    batch = torch.tensor([0, 0, 1, 1])
    new_x, new_e, new_u = block(x, index, e, u, batch)

    def apply(update, *inputs):
        return update.rest(update.first(torch.cat(inputs)))

    for k in range(3):
        source, target = index[:, k]
        expected = apply(block.edge_model, x[source], x[target], e[k], u[batch[source]])
        torch.testing.assert_close(new_e[k], expected)
    for i in range(4):
        incoming = new_e[index[1] == i].sum(0)
        expected = apply(block.node_model, incoming, x[i], u[batch[i]])
        torch.testing.assert_close(new_x[i], expected)
    for g in range(2):
        edges, nodes = new_e[batch[index[0]] == g].sum(0), new_x[batch == g].sum(0)
        torch.testing.assert_close(new_u[g], apply(block.global_model, edges, nodes, u[g]))


def test_compact_networks_fit_in_15_megabytes():
    with torch.device("meta"):
        networks = [BehaviorNetwork(config) for config in COMPACT.behaviors]
        networks.append(LocalizationNetwork(COMPACT.localization))
    total = sum(p.numel() for network in networks for p in network.parameters())
    assert total * 4 < 15e6


def test_bytes_and_floats_give_the_same_features():
    encoder = DepthEncoder(COMPACT.localization.encoder, COMPACT.image, 2).eval()
    frames = torch.randint(0, 256, (2, 2, 32, 96), dtype=torch.uint8)
    with torch.no_grad():
        torch.testing.assert_close(encoder(frames), encoder(frames.float() / 255))


def test_bins_take_one_side_where_regression_takes_the_middle():
    head = VelocityHead(VelocityHeadConfig("bins"), VelocityLimits())
    commands = torch.tensor([[0.2, 0.9], [0.2, -0.9], [0.2, 0.9]])
    outputs = torch.zeros(1, head.inputs, requires_grad=True)
    optimizer = torch.optim.Adam([outputs], lr=0.2)
    for _ in range(150):
        optimizer.zero_grad()
        head.loss(outputs.expand(3, -1), commands).mean().backward()
        optimizer.step()
    velocity = head.velocity(outputs.detach())
    assert velocity[0, 0] == pytest.approx(0.2, abs=0.01)
    assert velocity[0, 1] == pytest.approx(0.9, abs=0.1)


def test_bins_keep_to_the_side_they_took():
    head = VelocityHead(VelocityHeadConfig("bins", bins=25), VelocityLimits())
    outputs = torch.full((1, head.inputs), -8.0)
    outputs[0, 1 + 4], outputs[0, 1 + 20] = 2.0, 2.1
    assert head.velocity(outputs)[0, 1] > 0.5
    assert head.velocity(outputs, torch.tensor([-1.0]))[0, 1] < -0.5
    outputs[0, 1 + 20] = 4.0
    assert head.velocity(outputs, torch.tensor([-1.0]))[0, 1] > 0.5


def test_bins_return_the_command_they_were_taught():
    head = VelocityHead(VelocityHeadConfig("bins"), VelocityLimits())
    commands = torch.stack([torch.linspace(0, 0.5, 41), torch.linspace(-1.5, 1.5, 41)], 1)
    logits = head._soft_bins(commands[:, 1] / 1.5).clamp(min=1e-6).log()
    outputs = torch.cat([commands[:, :1] / 0.5, logits], 1)
    torch.testing.assert_close(head.velocity(outputs), commands, atol=2e-3, rtol=0)


def test_mode_is_found_at_the_limits():
    head = VelocityHead(VelocityHeadConfig("bins"), VelocityLimits())
    outputs = torch.full((2, head.inputs), -9.0)
    outputs[0, 1], outputs[1, -1] = 9.0, 9.0
    turn = head.velocity(outputs)[:, 1]
    np.testing.assert_allclose(turn.numpy(), [-1.5, 1.5], atol=1e-3)


def test_unknown_preset_offers_a_name():
    with pytest.raises(InputError, match="did you mean 'compact'"):
        get_preset("compct")


def test_kernel_larger_than_the_image_is_refused():
    with pytest.raises(InputError, match="convolution 1"):
        encoder_output_shape(PAPER.localization.encoder, ImageSpec(4, 4, "pinhole"))


def test_offsets_count_down_to_now():
    with pytest.raises(InputError, match="count down to 0"):
        dataclasses.replace(COMPACT.localization, frame_offsets=(0, 5))

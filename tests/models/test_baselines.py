import dataclasses

import numpy as np
import pytest
import torch

from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior
from toponav.models.baselines.behavrnn import BehavRNN
from toponav.models.baselines.phasenet import PhaseNet
from toponav.models.baselines.presets import get_baseline_preset
from toponav.models.checkpoints import (
    load_behavrnn,
    load_checkpoint,
    load_phasenet,
    save_checkpoint,
)
from toponav.models.graphnav.presets import Convolution, EncoderConfig, ImageSpec

IMAGE = ImageSpec(16, 48, "equal_angles")
SMALL = {
    "image": IMAGE,
    "frame_offsets": (2, 0),
    "encoder": EncoderConfig(
        (Convolution(4, (5, 5), 4), Convolution(8, (3, 3))), padded=True, features=12
    ),
    "recurrent_size": 10,
    "embedding": 6,
}
PHASENET = dataclasses.replace(get_baseline_preset("compact").phasenet, **SMALL)
BEHAVRNN = dataclasses.replace(get_baseline_preset("compact").behavrnn, **SMALL)
LENGTHS = (5, 2, 7)


@pytest.fixture
def phasenet():
    torch.manual_seed(0)
    return PhaseNet(PHASENET).eval()


@pytest.fixture
def behavrnn():
    torch.manual_seed(0)
    return BehavRNN(BEHAVRNN).eval()


def _sequences():
    """Stacks of three sequences of unequal length, one by one and packed step by step."""
    generator = torch.Generator().manual_seed(1)
    alone = [
        torch.randint(0, 256, (length, 2, 16, 48), dtype=torch.uint8, generator=generator)
        for length in LENGTHS
    ]
    is_there = torch.arange(max(LENGTHS))[:, None] < torch.tensor(LENGTHS)
    packed = [
        alone[row][step]
        for step in range(max(LENGTHS))
        for row in range(len(LENGTHS))
        if is_there[step, row]
    ]
    return alone, torch.stack(packed), is_there


PLANS = [torch.tensor(plan) for plan in ([1, 2, 0, 3], [1], [1, 3, 0, 0, 2])]


@torch.no_grad()
def test_phases_of_a_batch_are_those_of_each_sequence_step_by_step(phasenet):
    alone, packed, is_there = _sequences()
    behavior = torch.tensor([0, 2, 3])
    together = phasenet(packed, is_there, behavior)
    assert ((together > 0) & (together < 1)).all()
    for row, frames in enumerate(alone):
        state = None
        for step, stack in enumerate(frames):
            number = int(behavior[row])
            phase, state = phasenet.act(stack.numpy(), list(Behavior)[number], state)
            assert phase == pytest.approx(float(together[step, row]), abs=1e-5)


@torch.no_grad()
def test_decisions_of_a_batch_are_those_of_each_drive_step_by_step(behavrnn):
    alone, packed, is_there = _sequences()
    together = torch.softmax(behavrnn(packed, is_there, PLANS), -1)
    for row, frames in enumerate(alone):
        state = behavrnn.start([list(Behavior)[number] for number in PLANS[row].tolist()])
        for step, stack in enumerate(frames):
            probability, state = behavrnn.act(stack.numpy(), state)
            np.testing.assert_allclose(probability, together[step, row].numpy(), atol=1e-5)


@torch.no_grad()
def test_what_is_executed_changes_the_phase(phasenet):
    _, packed, is_there = _sequences()
    first, second = (phasenet(packed, is_there, torch.full((3,), kind)) for kind in (0, 2))
    assert not torch.allclose(first[is_there], second[is_there])


@torch.no_grad()
def test_order_of_the_plan_reaches_the_decision(behavrnn):
    turned = [plan.flip(0) for plan in PLANS]
    for before, after in zip(behavrnn.read(PLANS), behavrnn.read(turned), strict=True):
        assert not torch.allclose(before[:, 0], after[:, 0])
        torch.testing.assert_close(before[:, 1], after[:, 1])
    forwards = dataclasses.replace(BEHAVRNN, reads_backwards=False)
    same = BehavRNN(forwards).eval()
    same.load_state_dict(behavrnn.state_dict())
    for before, after in zip(behavrnn.read(PLANS), same.read(turned), strict=True):
        torch.testing.assert_close(before, after)


def test_gradients_reach_every_parameter(phasenet, behavrnn):
    _, packed, is_there = _sequences()
    phasenet.train()(packed, is_there, torch.tensor([0, 1, 2]))[is_there].sum().backward()
    behavrnn.train()(packed, is_there, PLANS)[is_there].square().sum().backward()
    for model in (phasenet, behavrnn):
        for name, parameter in model.named_parameters():
            assert parameter.grad is not None, name
            assert parameter.grad.abs().sum() > 0, name


def test_checkpoints_give_the_same_networks(phasenet, behavrnn, tmp_path):
    for model in (phasenet, behavrnn):
        loaded = load_checkpoint(save_checkpoint(model, tmp_path / model.kind))
        assert loaded.config == model.config
        for name, value in model.state_dict().items():
            assert torch.equal(loaded.state_dict()[name], value)
    assert load_phasenet(tmp_path).config == PHASENET
    assert load_behavrnn(tmp_path).config == BEHAVRNN


def test_weights_without_a_baseline_say_how_to_train_it(behavrnn, tmp_path):
    with pytest.raises(InputError, match="have no phasenet") as caught:
        load_phasenet(tmp_path)
    assert "toponav train phasenet" in str(caught.value)
    save_checkpoint(behavrnn, tmp_path / "phasenet")
    with pytest.raises(InputError, match="for behavrnn, not phasenet"):
        load_phasenet(tmp_path)


def test_paper_preset_is_the_cnn_lstm_that_the_paper_describes():
    paper = get_baseline_preset("paper")
    for config in (paper.phasenet, paper.behavrnn):
        assert config.encoder.convolutions[-1].channels == 512
        assert (config.recurrent_layers, config.recurrent_size) == (2, 512)
        assert config.frame_offsets == (0,)
        assert (config.image.rows, config.image.cols) == (240, 320)
    with torch.device("meta"):
        assert PhaseNet(paper.phasenet).memory.num_layers == 2
        assert BehavRNN(paper.behavrnn).decoder.hidden_size == 512


def test_bad_sizes_are_refused():
    with pytest.raises(InputError, match="no preset 'compct'"):
        get_baseline_preset("compct")
    for change in ({"frame_offsets": (0, 2)}, {"recurrent_layers": 0}, {"finished_at": 1.0}):
        with pytest.raises(InputError):
            dataclasses.replace(PHASENET, **change)
    with pytest.raises(InputError, match="stride"):
        dataclasses.replace(BEHAVRNN, stride=0)

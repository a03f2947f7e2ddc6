import hashlib
import json
import struct

import pytest
import torch
from safetensors.torch import load_file, save_file

from tests.models.graphs import crops, random_stacks
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior
from toponav.models.checkpoints import (
    checkpoint_metadata,
    load_checkpoint,
    load_weights,
    save_checkpoint,
)
from toponav.models.graphnav.behavior import BehaviorNetwork
from toponav.models.graphnav.graph_tensors import batch_graphs
from toponav.models.graphnav.localization import LocalizationNetwork
from toponav.models.graphnav.presets import get_preset

COMPACT = get_preset("compact")


@pytest.fixture
def saved(tmp_path):
    torch.manual_seed(0)
    model = BehaviorNetwork(COMPACT.behavior(Behavior.TURN_LEFT))
    return save_checkpoint(model, tmp_path / "net", {"preset": "compact"})


def _seal(path):
    """Make the digest right again, as a thorough attacker would."""
    sidecar = path.with_suffix(".json")
    document = json.loads(sidecar.read_text())
    document["sha256"] = hashlib.sha256(path.read_bytes()).hexdigest()
    sidecar.write_text(json.dumps(document))


def _edit(path, **changes):
    sidecar = path.with_suffix(".json")
    sidecar.write_text(json.dumps(json.loads(sidecar.read_text()) | changes))


def test_checkpoint_gives_the_same_network(tmp_path):
    model = LocalizationNetwork(COMPACT.localization).eval()
    path = save_checkpoint(model, tmp_path / "net.safetensors", {"note": "x"})
    loaded = load_checkpoint(tmp_path / "net")
    assert not loaded.training
    assert loaded.config == model.config
    assert checkpoint_metadata(path)["metadata"] == {"note": "x"}
    graphs = batch_graphs(crops(COMPACT.localization))
    frames = random_stacks(COMPACT.localization, graphs.graphs)
    with torch.no_grad():
        torch.testing.assert_close(loaded(frames, graphs), model(frames, graphs))


def test_half_precision_halves_the_file_and_loads_as_float32(saved, tmp_path):
    model = load_checkpoint(saved)
    half = save_checkpoint(model, tmp_path / "half", dtype="float16")
    assert half.stat().st_size < 0.55 * saved.stat().st_size
    for name, value in load_checkpoint(half).state_dict().items():
        if value.is_floating_point():
            assert value.dtype == torch.float32, name
            torch.testing.assert_close(value, model.state_dict()[name], rtol=2e-3, atol=2e-3)


def test_weights_of_a_folder_are_found(tmp_path):
    for config in COMPACT.behaviors:
        save_checkpoint(BehaviorNetwork(config), tmp_path / f"behavior_{config.behavior}")
    with pytest.raises(InputError, match=r"localization\.json"):
        load_weights(tmp_path)
    save_checkpoint(LocalizationNetwork(COMPACT.localization), tmp_path / "localization")
    weights = load_weights(tmp_path)
    assert set(weights.behaviors) == set(Behavior)
    swapped = tmp_path / "behavior_turn_left.json"
    (tmp_path / "behavior_turn_left.safetensors").write_bytes(
        (tmp_path / "behavior_turn_right.safetensors").read_bytes()
    )
    swapped.write_text((tmp_path / "behavior_turn_right.json").read_text())
    with pytest.raises(InputError, match="not the network for turn_left"):
        load_weights(tmp_path)


def test_unknown_weights_are_refused():
    with pytest.raises(InputError, match="no weights 'nowhere'"):
        load_weights("nowhere")


@pytest.mark.parametrize("size", [0, 4, 100, 5000])
def test_cut_files_are_refused(saved, size):
    saved.write_bytes(saved.read_bytes()[:size])
    with pytest.raises(InputError, match=r"net\.safetensors"):
        load_checkpoint(saved)
    _seal(saved)
    with pytest.raises(InputError, match=r"net\.safetensors"):
        load_checkpoint(saved)


def test_flipped_byte_is_refused(saved):
    data = bytearray(saved.read_bytes())
    data[-9] ^= 1
    saved.write_bytes(data)
    with pytest.raises(InputError, match="digest"):
        load_checkpoint(saved)


def test_giant_header_is_refused(saved):
    saved.write_bytes(struct.pack("<Q", 1 << 60) + saved.read_bytes()[8:])
    _seal(saved)
    with pytest.raises(InputError, match="header"):
        load_checkpoint(saved)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda t, n: t.update({n: torch.zeros(3)}), "its shape has to be"),
        (lambda t, n: t.update({n: t[n] * float("nan")}), "finite"),
        (lambda t, n: t.update({n: t[n].to(torch.int64)}), "float32 or float16"),
        (lambda t, n: t.pop(n), "missing"),
        (lambda t, n: t.update(intruder=torch.zeros(1)), "no such tensor"),
    ],
)
def test_tensors_that_do_not_fit_are_named(saved, change, word):
    tensors = load_file(saved)
    name = "encoder.convolutions.0.weight"
    change(tensors, name)
    save_file(tensors, saved)
    _seal(saved)
    with pytest.raises(InputError, match=word) as caught:
        load_checkpoint(saved)
    assert name in str(caught.value) or "intruder" in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"kind": "os.system"}, "no kind of network"),
        ({"schema": 99}, "schema"),
        ({"config": []}, "config"),
        ({"sha256": 5}, "sha256"),
    ],
)
def test_strange_documents_are_refused(saved, changes, word):
    _edit(saved, **changes)
    with pytest.raises(InputError, match=word):
        load_checkpoint(saved)


@pytest.mark.parametrize(
    ("key", "value", "word"),
    [
        ("behavior", "turn_lift", r"config\.behavior"),
        ("behavior", ["turn_left"], r"config\.behavior"),
        ("frame_offsets", [0, 5], "count down"),
        ("frame_offsets", "0", r"config\.frame_offsets"),
        ("recurrent_size", 10**12, "recurrent"),
        ("recurrent_size", True, r"config\.recurrent_size"),
        ("encoder", {}, "lacks 'convolutions'"),
        ("extra", 1, "no 'extra'"),
    ],
)
def test_strange_configurations_are_refused(saved, key, value, word):
    document = json.loads(saved.with_suffix(".json").read_text())
    document["config"][key] = value
    saved.with_suffix(".json").write_text(json.dumps(document))
    with pytest.raises(InputError, match=word):
        load_checkpoint(saved)


def test_fields_added_later_take_their_default(saved):
    document = json.loads(saved.with_suffix(".json").read_text())
    del document["config"]["head"]["inertia"]
    saved.with_suffix(".json").write_text(json.dumps(document))
    assert load_checkpoint(saved).config.head.inertia == 0.5


def test_huge_configuration_allocates_nothing(saved):
    document = json.loads(saved.with_suffix(".json").read_text())
    document["config"] |= {"recurrent_layers": 8, "recurrent_size": 8192}
    saved.with_suffix(".json").write_text(json.dumps(document))
    with pytest.raises(InputError, match="tensor memory"):
        load_checkpoint(saved)


def test_broken_json_is_refused(saved):
    saved.with_suffix(".json").write_text("{")
    with pytest.raises(InputError, match=r"net\.json"):
        load_checkpoint(saved)
    saved.with_suffix(".json").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=r"net\.json"):
        load_checkpoint(saved)
    saved.with_suffix(".json").unlink()
    with pytest.raises(InputError, match="no such file"):
        load_checkpoint(saved)

"""Checkpoints: weights in safetensors, what they mean in JSON beside them. Nothing unpickles.

`name.safetensors` holds tensors and `name.json` the kind of network, its configuration, where
it came from, and the digest of the weights. A network is only ever built from the kinds
registered here, and only after the tensors' names and shapes fit its configuration.
"""

import hashlib
import json
import math
import struct
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path
from typing import Any, Literal

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save as safetensors_bytes

from toponav.core.errors import InputError, did_you_mean
from toponav.core.files import read_json_object, write_atomically
from toponav.core.typed_json import from_json
from toponav.core.vocabulary import Behavior
from toponav.models.baselines.behavrnn import BehavRNN
from toponav.models.baselines.image_goal import ImageGoalNetwork
from toponav.models.baselines.image_goal_presets import ImageGoalConfig
from toponav.models.baselines.phasenet import PhaseNet
from toponav.models.baselines.presets import BehavRNNConfig, PhaseNetConfig
from toponav.models.graphnav.behavior import BehaviorNetwork
from toponav.models.graphnav.localization import LocalizationNetwork
from toponav.models.graphnav.metric.pose_network import PoseNetwork
from toponav.models.graphnav.metric.presets import PoseConfig, SteeringConfig
from toponav.models.graphnav.metric.steering import SteeringNetwork
from toponav.models.graphnav.presets import BehaviorConfig, LocalizationConfig
from toponav.models.nts.network import NTSNetwork
from toponav.models.nts.presets import NTSConfig

__all__ = [
    "SCHEMA_VERSION",
    "GraphNavWeights",
    "MetricWeights",
    "Network",
    "checkpoint_metadata",
    "find_weights",
    "holds_metric_weights",
    "load_any_weights",
    "load_behavrnn",
    "load_checkpoint",
    "load_metric_weights",
    "load_nts",
    "load_phasenet",
    "load_weights",
    "save_checkpoint",
    "write_atomically",
]

SCHEMA_VERSION = 1

Network = (
    BehaviorNetwork
    | LocalizationNetwork
    | PhaseNet
    | BehavRNN
    | PoseNetwork
    | SteeringNetwork
    | NTSNetwork
    | ImageGoalNetwork
)

_REGISTRY: dict[str, tuple[type[Network], type[Any]]] = {
    "behavior": (BehaviorNetwork, BehaviorConfig),
    "localization": (LocalizationNetwork, LocalizationConfig),
    "phasenet": (PhaseNet, PhaseNetConfig),
    "behavrnn": (BehavRNN, BehavRNNConfig),
    "pose": (PoseNetwork, PoseConfig),
    "steering": (SteeringNetwork, SteeringConfig),
    "nts": (NTSNetwork, NTSConfig),
    "image_goal": (ImageGoalNetwork, ImageGoalConfig),
}
_MOST_BYTES = 2 << 30
_MOST_HEADER_BYTES = 1 << 20
_MOST_JSON_BYTES = 1 << 20
_TRAIN_AGAIN = "copy it again, or train again with `toponav train`"


@dataclass(frozen=True)
class MetricWeights:
    """The networks of a robot that believes in poses (preset `best`)."""

    pose: PoseNetwork
    steering: SteeringNetwork


class GraphNavWeights:
    """The networks of one robot: a behaviour network for each behaviour, and localization."""

    def __init__(
        self, behaviors: Mapping[Behavior, BehaviorNetwork], localization: LocalizationNetwork
    ) -> None:
        self.behaviors = dict(behaviors)
        self.localization = localization


def save_checkpoint(
    model: Network,
    path: str | Path,
    metadata: Mapping[str, Any] | None = None,
    *,
    dtype: Literal["float32", "float16"] = "float32",
) -> Path:
    """The path of the weights, written with their JSON beside them, each file at once or not.

    Args:
        model: A network of a registered kind.
        path: `name.safetensors`; the suffix is added when missing.
        metadata: What to remember of its training: preset, data, commit, metrics.
        dtype: How to store the weights. `float16` halves the file; loading gives float32.
    """
    weights = _with_suffix(Path(path))
    wanted = getattr(torch, dtype)
    tensors = {
        name: (value.to(wanted) if value.is_floating_point() else value).detach().contiguous()
        for name, value in model.state_dict().items()
    }
    data = safetensors_bytes(tensors)
    document = {
        "schema": SCHEMA_VERSION,
        "kind": model.kind,
        "config": asdict(model.config),
        "sha256": hashlib.sha256(data).hexdigest(),
        "parameters": sum(value.numel() for value in model.parameters()),
        "dtype": dtype,
        "metadata": dict(metadata or {}),
    }
    text = json.dumps(document, indent=1, allow_nan=False) + "\n"
    write_atomically(weights, data)
    write_atomically(weights.with_suffix(".json"), text.encode())
    return weights


def load_checkpoint(path: str | Path) -> Network:
    """The network stored at `path`, in evaluation mode, in float32.

    Raises:
        InputError: A file is missing, cut short, altered, of another kind, or holds tensors
            that do not fit the network or are not finite. The error names file and tensor.
    """
    weights = _with_suffix(Path(path))
    document = _read_sidecar(weights.with_suffix(".json"))
    _check_file(weights, document["sha256"])
    network_type, config_type = _REGISTRY[document["kind"]]
    where = str(weights.with_suffix(".json"))
    config = from_json(
        config_type, document["config"], where=where, key="config", remedy=_TRAIN_AGAIN
    )
    # On the meta device nothing is allocated, however large a hostile configuration is.
    with torch.device("meta"):
        model = network_type(config)
    tensors = _read_tensors(weights, model.state_dict())
    with torch.device("cpu"):
        model = network_type(config)
    model.load_state_dict(tensors)
    return model.eval()


def checkpoint_metadata(path: str | Path) -> dict[str, Any]:
    """The JSON beside a checkpoint: kind, configuration, digest, and its training's metadata.

    Raises:
        InputError: The JSON is missing or broken.
    """
    return _read_sidecar(_with_suffix(Path(path)).with_suffix(".json"))


def load_weights(name_or_dir: str | Path = "compact") -> GraphNavWeights:
    """The networks of a folder, or the ones that ship with the package under a preset's name.

    Args:
        name_or_dir: A preset's name, or a folder with `behavior_<name>.safetensors` for each
            behaviour and `localization.safetensors`, such as `toponav train` writes.

    Raises:
        InputError: There are no such weights, or one of the files is broken.
    """
    directory = find_weights(name_or_dir)
    behaviors = {}
    for behavior in Behavior:
        path = directory / f"behavior_{behavior}.safetensors"
        network = load_checkpoint(path)
        if not isinstance(network, BehaviorNetwork) or network.config.behavior is not behavior:
            raise InputError(
                f"this is not the network for {behavior}", where=str(path), remedy=_TRAIN_AGAIN
            )
        behaviors[behavior] = network
    path = directory / "localization.safetensors"
    localization = load_checkpoint(path)
    if not isinstance(localization, LocalizationNetwork):
        raise InputError(
            "this is not a localization network", where=str(path), remedy=_TRAIN_AGAIN
        )
    return GraphNavWeights(behaviors, localization)


def holds_metric_weights(name_or_dir: str | Path) -> bool:
    """Whether these are weights of the kind of preset `best`: a pose and a steering network.

    Raises:
        InputError: There are no such weights.
    """
    return (find_weights(name_or_dir) / "steering.safetensors").is_file()


def load_metric_weights(name_or_dir: str | Path = "best") -> MetricWeights:
    """The pose and steering networks of a folder, or those that ship with the package.

    Raises:
        InputError: There are no such weights, or one of the files is broken.
    """
    directory = find_weights(name_or_dir)
    pose = load_checkpoint(directory / "pose.safetensors")
    steering = load_checkpoint(directory / "steering.safetensors")
    if not (isinstance(pose, PoseNetwork) and isinstance(steering, SteeringNetwork)):
        raise InputError(
            "these are not a pose and a steering network",
            where=str(directory),
            remedy=_TRAIN_AGAIN,
        )
    if pose.config.local_map != steering.config.local_map:
        raise InputError(
            "the pose and the steering network must see the same local map",
            where=str(directory),
            remedy=_TRAIN_AGAIN,
        )
    return MetricWeights(pose, steering)


def load_any_weights(name_or_dir: str | Path) -> GraphNavWeights | MetricWeights:
    """The networks that GraphNav drives with, whichever kind these are.

    Raises:
        InputError: There are no such weights, or one of the files is broken.
    """
    if holds_metric_weights(name_or_dir):
        return load_metric_weights(name_or_dir)
    return load_weights(name_or_dir)


def load_phasenet(name_or_dir: str | Path = "compact") -> PhaseNet:
    """The PhaseNet of a folder, or the one that ships with the package under a preset's name.

    Raises:
        InputError: There is none, or its files are broken.
    """
    network = _load_baseline(name_or_dir, PhaseNet.kind)
    assert isinstance(network, PhaseNet)
    return network


def load_behavrnn(name_or_dir: str | Path = "compact") -> BehavRNN:
    """The BehavRNN of a folder, or the one that ships with the package under a preset's name.

    Raises:
        InputError: There is none, or its files are broken.
    """
    network = _load_baseline(name_or_dir, BehavRNN.kind)
    assert isinstance(network, BehavRNN)
    return network


def load_nts(name_or_dir: str | Path = "nts", *, depth: bool) -> NTSNetwork:
    """The network of Neural Topological SLAM of a folder, or the one that ships.

    Args:
        name_or_dir: A folder with `nts_rgb.safetensors` or `nts_rgbd.safetensors`, such as
            `toponav train nts` writes, or `nts` for the weights that ship.
        depth: Whether it is the one that sees depth besides colour.

    Raises:
        InputError: There is none, or its files are broken.
    """
    name = "nts_rgbd" if depth else "nts_rgb"
    path = find_weights(name_or_dir) / f"{name}.safetensors"
    if not path.is_file():
        raise InputError(
            f"these weights have no {name}",
            where=str(path),
            remedy=f"train one: `toponav train nts --data PANORAMAS --out {path.parent}`, or use "
            "the one that ships: nts",
        )
    network = load_checkpoint(path)
    if not isinstance(network, NTSNetwork) or network.config.depth is not depth:
        raise InputError(f"this is not {name}", where=str(path), remedy=_TRAIN_AGAIN)
    return network


def _load_baseline(name_or_dir: str | Path, kind: str) -> Network:
    path = find_weights(name_or_dir) / f"{kind}.safetensors"
    if not path.is_file():
        raise InputError(
            f"these weights have no {kind}",
            where=str(path),
            remedy=f"train one: `toponav train {kind} --data CACHE --out {path.parent}`, or drive "
            f"with the one that ships: --agent {kind}=compact",
        )
    network = load_checkpoint(path)
    if network.kind != kind:
        raise InputError(
            f"this is a network for {network.kind}, not {kind}",
            where=str(path),
            remedy=_TRAIN_AGAIN,
        )
    return network


def find_weights(name_or_dir: str | Path) -> Path:
    """The folder itself, or that of the weights that ship under a preset's name.

    Raises:
        InputError: There are no such weights.
    """
    directory = Path(name_or_dir)
    if directory.is_dir():
        return directory
    shipped = Path(str(resources.files("toponav.weights")))
    if isinstance(name_or_dir, str) and (shipped / name_or_dir).is_dir():
        return shipped / name_or_dir
    names = [entry.name for entry in shipped.iterdir() if (entry / "localization.json").is_file()]
    raise InputError(
        f"there are no weights {str(name_or_dir)!r}",
        where="--weights",
        remedy=f"give a folder written by `toponav train`, or {' or '.join(sorted(names))}",
    )


def _with_suffix(path: Path) -> Path:
    return path if path.suffix == ".safetensors" else path.with_name(path.name + ".safetensors")


def _read_sidecar(path: Path) -> dict[str, Any]:
    def broken(rule: str) -> InputError:
        return InputError(rule, where=str(path), remedy=_TRAIN_AGAIN)

    if not path.is_file():
        raise broken("there is no such file; a checkpoint is a .safetensors and a .json")
    document = read_json_object(path, max_bytes=_MOST_JSON_BYTES)
    if document.get("schema") != SCHEMA_VERSION:
        raise broken(f"schema has to be {SCHEMA_VERSION}, got {document.get('schema')!r}")
    kind = document.get("kind")
    if not isinstance(kind, str) or kind not in _REGISTRY:
        raise broken(f"there is no kind of network {kind!r}; {did_you_mean(str(kind), _REGISTRY)}")
    if not isinstance(document.get("sha256"), str) or not isinstance(document.get("config"), dict):
        raise broken("it has to give 'sha256' and 'config'")
    return document


def _check_file(path: Path, sha256: str) -> None:
    def broken(rule: str) -> InputError:
        return InputError(rule, where=str(path), remedy=_TRAIN_AGAIN)

    if not path.is_file():
        raise broken("there is no such file")
    size = path.stat().st_size
    if not 8 <= size <= _MOST_BYTES:
        raise broken(f"weights are 8..{_MOST_BYTES} bytes, got {size}")
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        (header,) = struct.unpack("<Q", file.read(8))
        if header > min(size - 8, _MOST_HEADER_BYTES):
            raise broken(f"its header says {header} bytes, more than fits: the file is cut or bad")
        file.seek(0)
        while block := file.read(1 << 20):
            digest.update(block)
    if digest.hexdigest() != sha256:
        raise broken("its digest is not the one in the .json beside it: cut short or altered")


def _read_tensors(path: Path, wanted: Mapping[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Every tensor the network wants, and no other, with the shapes it wants."""

    def broken(rule: str, tensor: str) -> InputError:
        return InputError(rule, where=f"{path}, tensor {tensor}", remedy=_TRAIN_AGAIN)

    found: dict[str, torch.Tensor] = {}
    try:
        with safe_open(path, framework="pt") as file:
            names = set(file.keys())
            for name in sorted(names - wanted.keys()):
                raise broken("the network has no such tensor", name)
            for name, expected in wanted.items():
                if name not in names:
                    raise broken("it is missing", name)
                shape = tuple(file.get_slice(name).get_shape())
                if shape != tuple(expected.shape):
                    raise broken(f"its shape has to be {tuple(expected.shape)}, got {shape}", name)
                found[name] = _checked(file.get_tensor(name), expected, name, broken)
    except SafetensorError as error:
        raise InputError(
            f"it cannot be read as safetensors: {error}", where=str(path), remedy=_TRAIN_AGAIN
        ) from None
    return found


def _checked(value: torch.Tensor, expected: torch.Tensor, name: str, broken: Any) -> torch.Tensor:
    if expected.is_floating_point():
        if value.dtype not in (torch.float32, torch.float16, torch.bfloat16):
            raise broken(f"it has to hold float32 or float16, got {value.dtype}", name)
        value = value.to(torch.float32)
        if not math.isfinite(value.abs().max().item() if value.numel() else 0.0):
            raise broken("it has to be finite, got NaN or infinity", name)
    elif value.dtype != expected.dtype:
        raise broken(f"it has to hold {expected.dtype}, got {value.dtype}", name)
    return value

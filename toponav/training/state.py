"""Training that goes on after it was killed, exactly where it was.

An epoch's state is one safetensors file (weights, their moving average, optimizer moments,
random state) and `state.json`, which names it and its digest and is replaced last: whenever
the process dies, the JSON points at a whole file. Nothing is pickled.
"""

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load as safetensors_load
from safetensors.torch import save as safetensors_bytes
from torch import Tensor, nn

from toponav.core.errors import InputError
from toponav.core.files import check_file_name, read_bytes, read_json_object
from toponav.core.typed_json import from_json
from toponav.models.checkpoints import write_atomically

__all__ = ["Progress", "restore_state", "save_state"]

_MOST_BYTES = 4 << 30
_OF_FILE = ("file", "sha256")


@dataclass
class Progress:
    """Where a run of training is."""

    fingerprint: str
    """Digest of configuration and data: a run is not resumed as another."""
    precision: str
    planned_epochs: int
    epoch: int = 0
    """Epochs finished."""
    step: int = 0
    schedule: float = 0.0
    """How far the learning rate's schedule is, 0..1."""
    elapsed_s: float = 0.0
    best_score: float | None = None
    best_epoch: int = 0
    history: list[dict[str, int | float]] = field(default_factory=list)
    """One record an epoch."""


def save_state(
    directory: Path,
    progress: Progress,
    model: nn.Module,
    shadow: nn.Module,
    optimizer: torch.optim.Optimizer,
) -> None:
    """Write one epoch's state; the one before is deleted once this one is whole."""
    tensors: dict[str, Tensor] = {"random": torch.get_rng_state()}
    tensors |= {f"model.{name}": value for name, value in model.state_dict().items()}
    if shadow is not model:
        tensors |= {f"shadow.{name}": value for name, value in shadow.state_dict().items()}
    for number, moments in optimizer.state_dict()["state"].items():
        tensors |= {f"optimizer.{number}.{name}": value for name, value in moments.items()}
    data = safetensors_bytes({name: value.contiguous() for name, value in tensors.items()})
    path = directory / f"state-{progress.epoch:05d}.safetensors"
    write_atomically(path, data)
    document = vars(progress) | {
        "file": path.name,
        "sha256": hashlib.sha256(data).hexdigest(),
    }
    write_atomically(directory / "state.json", json.dumps(document, indent=1).encode())
    for old in directory.glob("state-*.safetensors"):
        if old != path:
            old.unlink()


def restore_state(
    directory: Path,
    fingerprint: str,
    model: nn.Module,
    shadow: nn.Module,
    optimizer: torch.optim.Optimizer,
) -> Progress | None:
    """Put everything back as it was after the last whole epoch; None when there is none.

    Raises:
        InputError: The state is of another run (configuration or data differ), or damaged.
    """
    path = directory / "state.json"
    if not path.is_file():
        return None
    document = _read(path)
    if document["fingerprint"] != fingerprint:
        raise InputError(
            "it holds a run with another configuration, thread count, version or data",
            where=str(directory),
            remedy="give another --out, or delete the folder to start again",
        )
    weights = directory / document.pop("file")
    tensors = _tensors(weights, document.pop("sha256"))
    try:
        model.load_state_dict(_under(tensors, "model."))
        if shadow is not model:
            shadow.load_state_dict(_under(tensors, "shadow."))
        _restore_optimizer(optimizer, _under(tensors, "optimizer."))
        torch.set_rng_state(tensors["random"])
        return Progress(**document)
    except (RuntimeError, KeyError, TypeError, ValueError) as error:
        raise _damaged(path, str(error)) from None


def _restore_optimizer(optimizer: torch.optim.Optimizer, tensors: dict[str, Tensor]) -> None:
    state: dict[int, dict[str, Tensor]] = {}
    for key, value in tensors.items():
        number, name = key.split(".", 1)
        state.setdefault(int(number), {})[name] = value
    optimizer.load_state_dict(optimizer.state_dict() | {"state": state})


def _under(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {
        name.removeprefix(prefix): value
        for name, value in tensors.items()
        if name.startswith(prefix)
    }


def _read(path: Path) -> dict[str, Any]:
    try:
        document = read_json_object(path)
        check_file_name(document.get("file"), "file")
        if not {"fingerprint", "sha256", "history"} <= document.keys():
            raise ValueError("it lacks one of fingerprint, sha256, history")
        fields = {name: value for name, value in document.items() if name not in _OF_FILE}
        progress = from_json(Progress, fields, where="progress")
        if not 1 <= progress.best_epoch <= progress.epoch == len(progress.history):
            raise ValueError(f"epoch {progress.epoch} with {len(progress.history)} records")
    except ValueError as error:
        raise _damaged(path, str(error)) from None
    return document


def _tensors(path: Path, sha256: str) -> dict[str, Tensor]:
    if not path.is_file():
        raise _damaged(path, "it is missing")
    data = read_bytes(path, max_bytes=_MOST_BYTES)
    if hashlib.sha256(data).hexdigest() != sha256:
        raise _damaged(path, "its digest is not the one in state.json")
    try:
        return safetensors_load(data)
    except SafetensorError as error:
        raise _damaged(path, str(error)) from None


def _damaged(path: Path, why: str) -> InputError:
    return InputError(
        f"the state of training is damaged: {why}",
        where=str(path),
        remedy="delete the folder to start again",
    )

"""From a training run to the weights that ship: half precision, one folder, nothing else."""

from pathlib import Path
from typing import Any

from toponav.models.baselines.image_goal_weights import IMAGE_GOAL_NAMES, load_image_goal
from toponav.models.checkpoints import (
    Network,
    checkpoint_metadata,
    holds_metric_weights,
    load_behavrnn,
    load_metric_weights,
    load_nts,
    load_phasenet,
    load_weights,
    save_checkpoint,
)

__all__ = ["release_weights"]


def release_weights(run: Path, out: Path) -> dict[str, Any]:
    """Store a run's networks in half precision and say how large they are.

    PhaseNet and BehavRNN are stored too where the run has them.

    Args:
        run: Folder that `toponav train` wrote.
        out: Folder of the released weights; loads with `load_weights(out)`.

    Raises:
        InputError: A network is missing or broken.
    """
    networks = _nts_networks(run) | _image_goal_networks(run)
    if not networks:
        networks = _metric_networks(run) if holds_metric_weights(run) else _crop_networks(run)
    out.mkdir(parents=True, exist_ok=True)
    sizes = {}
    for name, network in networks.items():
        metadata = checkpoint_metadata(run / name)["metadata"]
        path = save_checkpoint(network, out / name, metadata, dtype="float16")
        sizes[name] = path.stat().st_size + path.with_suffix(".json").stat().st_size
    return {"out": str(out), "bytes": sum(sizes.values()), "networks": sizes}


def _nts_networks(run: Path) -> dict[str, Network]:
    """Those of Neural Topological SLAM that the run has."""
    kinds = {"nts_rgb": False, "nts_rgbd": True}
    return {
        name: load_nts(run, depth=depth)
        for name, depth in kinds.items()
        if (run / f"{name}.safetensors").is_file()
    }


def _image_goal_networks(run: Path) -> dict[str, Network]:
    """The learned baselines of image goals that the run has."""
    return {
        name: load_image_goal(name, run)
        for name in IMAGE_GOAL_NAMES
        if (run / f"{name}.safetensors").is_file()
    }


def _metric_networks(run: Path) -> dict[str, Network]:
    weights = load_metric_weights(run)
    return {"pose": weights.pose, "steering": weights.steering}


def _crop_networks(run: Path) -> dict[str, Network]:
    weights = load_weights(run)
    networks: dict[str, Network] = {
        f"behavior_{behavior}": network for behavior, network in weights.behaviors.items()
    }
    networks["localization"] = weights.localization
    if (run / "phasenet.safetensors").is_file():
        networks["phasenet"] = load_phasenet(run)
    if (run / "behavrnn.safetensors").is_file():
        networks["behavrnn"] = load_behavrnn(run)
    return networks

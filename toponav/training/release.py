"""From a training run to the weights that ship: half precision, one folder, nothing else."""

from pathlib import Path
from typing import Any

from toponav.models.checkpoints import checkpoint_metadata, load_weights, save_checkpoint

__all__ = ["release_weights"]


def release_weights(run: Path, out: Path) -> dict[str, Any]:
    """Store a run's six networks in half precision and say how large they are.

    Args:
        run: Folder that `toponav train` wrote.
        out: Folder of the released weights; loads with `load_weights(out)`.

    Raises:
        InputError: A network is missing or broken.
    """
    weights = load_weights(run)
    networks: dict[str, Any] = {
        f"behavior_{behavior}": network for behavior, network in weights.behaviors.items()
    }
    networks["localization"] = weights.localization
    out.mkdir(parents=True, exist_ok=True)
    sizes = {}
    for name, network in networks.items():
        metadata = checkpoint_metadata(run / name)["metadata"]
        path = save_checkpoint(network, out / name, metadata, dtype="float16")
        sizes[name] = path.stat().st_size + path.with_suffix(".json").stat().st_size
    return {"out": str(out), "bytes": sum(sizes.values()), "networks": sizes}

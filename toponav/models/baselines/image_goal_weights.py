"""The weights of the learned image-goal baselines: a folder's, or those that ship."""

import hashlib
from importlib import resources
from pathlib import Path

from torch import nn

from toponav.core.errors import InputError
from toponav.models.baselines.image_goal import ImageGoalNetwork
from toponav.models.checkpoints import find_weights, load_checkpoint, load_nts

__all__ = [
    "IMAGE_GOAL_NAMES",
    "IMAGE_GOAL_WEIGHTS",
    "digest_of_weights",
    "load_image_goal",
    "open_eyes",
    "ships",
]

IMAGE_GOAL_WEIGHTS = "imagenav"
"""Name of the folder of those that ship."""

IMAGE_GOAL_NAMES = (
    "il_rgb",
    "il_rgbd",
    "target_rl_rgb",
    "target_rl_rgbd",
    "metric_map_rl_rgbd",
)
"""The learned baselines, as their weights and agents are called."""


def ships(name: str) -> bool:
    """Whether weights of this name ship with the package."""
    shipped = Path(str(resources.files("toponav.weights"))) / IMAGE_GOAL_WEIGHTS
    return (shipped / f"{name}.safetensors").is_file()


def load_image_goal(name: str, name_or_dir: str | Path | None = None) -> ImageGoalNetwork:
    """The policy of a name, such as `il_rgbd`, in evaluation mode.

    Args:
        name: As `ImageGoalConfig.name` gives it.
        name_or_dir: A folder that `toponav train` wrote; None for the weights that ship.

    Raises:
        InputError: There is none, or its files are broken.
    """
    words = name.replace("metric_map_rl", "metric_rl").rsplit("_", 1)
    train = f"toponav train {words[0]} --modality {words[-1]} --out runs/{words[0]}"
    try:
        path = find_weights(name_or_dir or IMAGE_GOAL_WEIGHTS) / f"{name}.safetensors"
        is_there = path.is_file()
    except InputError:
        if name_or_dir is not None:
            raise
        is_there, path = False, Path(IMAGE_GOAL_WEIGHTS) / name
    if not is_there:
        raise InputError(
            f"these weights have no {name}",
            where=str(path) if name_or_dir else "the weights that ship",
            remedy=f"train them: `{train}`, then --agent {name}=runs/{words[0]}",
        )
    network = load_checkpoint(path)
    if not isinstance(network, ImageGoalNetwork) or network.config.name != name:
        raise InputError(
            f"this is not {name}", where=str(path), remedy=f"train it again: `{train}`"
        )
    return network


def open_eyes(network: ImageGoalNetwork, nts: str | Path = "nts") -> ImageGoalNetwork:
    """The network, seeing as Neural Topological SLAM does; as it was where it learns to see.

    Args:
        network: A new policy; changed in place.
        nts: Weights of Neural Topological SLAM: a folder, or what ships.

    Raises:
        InputError: There are none, or their sizes are others.
    """
    sight = network.sight
    if sight is None:
        return network
    other = load_nts(nts, depth=network.config.depth)
    matcher = getattr(other.heads, "matcher", None)
    try:
        assert matcher is not None
        sight.encoder.load_state_dict(other.encoder.state_dict())
        sight.matcher.load_state_dict(matcher.state_dict())
    except (RuntimeError, AssertionError):
        raise InputError(
            f"its eyes are not of the sizes of {network.config.name}",
            where=str(nts),
            remedy="give weights of preset compact, such as nts",
        ) from None
    return network


def digest_of_weights(network: nn.Module) -> str:
    """Identifies a network's weights."""
    digest = hashlib.sha256()
    for name, value in sorted(network.state_dict().items()):
        digest.update(name.encode())
        digest.update(value.cpu().contiguous().numpy().tobytes())
    return digest.hexdigest()

"""The weights of the learned image-goal baselines: a folder's, or those that ship."""

from importlib import resources
from pathlib import Path

from toponav.core.errors import InputError
from toponav.models.baselines.image_goal import ImageGoalNetwork
from toponav.models.checkpoints import find_weights, load_checkpoint

__all__ = ["IMAGE_GOAL_WEIGHTS", "load_image_goal", "ships"]

IMAGE_GOAL_WEIGHTS = "imagenav"
"""Name of the folder of those that ship."""


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

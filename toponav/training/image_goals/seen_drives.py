"""Drives as the eyes of a compact policy see them: looked at once, kept beside the pictures."""

import io
from typing import Any

import numpy as np
import torch

from toponav.core.arrays import map_npy
from toponav.core.files import write_atomically
from toponav.models.baselines.image_goal_sight import Sight
from toponav.models.baselines.image_goal_weights import digest_of_weights
from toponav.models.nts.encoder import folded
from toponav.training.image_goals.demonstrations import HomeDrives
from toponav.training.precision import Precision, autocast

__all__ = ["mirrored_pictures", "seen_in"]

_MIRROR_SHIFT = 4
_BATCH = 64


def seen_in(
    home: HomeDrives, sight: Sight, precision: Precision, *, mirrored: bool = False
) -> np.ndarray:
    """What `Sight.compare` says of every frame; float16[frames, size].

    Args:
        home: The drives; what is seen is kept in their folder, if they have one.
        sight: The eyes.
        precision: Number format of looking.
        mirrored: Whether left and right are swapped.
    """
    if home.folder is None:
        return _looked_at(home, sight, precision, mirrored)
    kind = "mirrored" if mirrored else "as-is"
    path = home.folder / f"seen-{digest_of_weights(sight)[:12]}-{precision}-{kind}.npy"
    if not path.is_file():
        content = io.BytesIO()
        np.save(content, _looked_at(home, sight, precision, mirrored))
        write_atomically(path, content.getvalue())
    size = (len(home.action), sight.size)
    return map_npy(path, "float16", size, remedy="delete the file and run the command again")


def mirrored_pictures(pictures: np.ndarray) -> np.ndarray:
    """Panoramas with left and right swapped; the columns that are straight ahead stay so."""
    return np.ascontiguousarray(np.roll(pictures[..., ::-1], _MIRROR_SHIFT, axis=-1))


@torch.inference_mode()
def _looked_at(home: HomeDrives, sight: Sight, precision: Precision, mirrored: bool) -> np.ndarray:
    eyes: Any = folded(sight)
    channels = sight.channels

    def encoded(pictures: np.ndarray) -> torch.Tensor:
        chosen = pictures[:, :channels]
        chosen = mirrored_pictures(chosen) if mirrored else np.array(chosen)
        found: torch.Tensor = eyes.encode(torch.from_numpy(chosen))
        return found

    found = []
    with autocast(precision):
        goals = torch.cat(
            [encoded(home.goal[k : k + _BATCH]) for k in range(0, len(home.goal), _BATCH)]
        )
        for k in range(0, len(home.image), _BATCH):
            seen = encoded(home.image[k : k + _BATCH])
            whose = torch.from_numpy(home.episode[k : k + _BATCH].astype(np.int64))
            found.append(eyes.compare(seen, goals[whose]).half().numpy())
    return np.concatenate(found)

"""What choosing a direction by F_S gains over chance, with and without looking at the goal."""

from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float32

from toponav.data.nts.labels import SCORE_LENGTH_M
from toponav.data.nts.panoramas import open_panoramas
from toponav.models.checkpoints import load_nts
from toponav.models.nts.network import NTSNetwork
from toponav.training.nts_recipe import samples_of_home
from toponav.training.nts_task import HomeSamples

__all__ = ["measure_nts_scores"]

_LEAST = 1e-3
_ENCODED_AT_ONCE = 16


def measure_nts_scores(folder: Path) -> dict[str, float]:
    """Gain and detour of the directions chosen by the networks that ship.

    Choices are between at least two explorable directions, for goals in other nodes. The gain is
    the share of what the best choice gains over chance; `without_goal` takes the score averaged
    over all goals.

    Args:
        folder: What `toponav collect nts` wrote, of homes that the networks have not seen.
    """
    homes = open_panoramas(folder)
    metrics: dict[str, float] = {}
    for name, depth in (("rgbd", True), ("rgb", False)):
        network = load_nts("nts", depth=depth)
        parts = [_of_home(network, samples_of_home(home, network.config)) for home in homes]
        score, length_m = (np.concatenate(column) for column in zip(*parts, strict=True))
        chance, best, by_goal, blind = score.mean(axis=0).tolist()
        metrics[f"{name}_gain"] = (by_goal - chance) / (best - chance)
        metrics[f"{name}_gain_without_goal"] = (blind - chance) / (best - chance)
        detour_m = (length_m - length_m[:, 1:2]).mean(axis=0).tolist()
        metrics["chance_detour_m"] = detour_m[0]
        metrics[f"{name}_detour_m"] = detour_m[2]
        metrics[f"{name}_detour_without_goal_m"] = detour_m[3]
        metrics["choices"] = len(score)
    return metrics


@torch.inference_mode()
def _of_home(
    network: NTSNetwork, home: HomeSamples
) -> tuple[Float32[np.ndarray, "choices 4"], Float32[np.ndarray, "choices 4"]]:
    """Score and length of the way by chance, at best, by the network, and by it without goal."""
    images = torch.from_numpy(np.ascontiguousarray(home.images[:, : network.config.channels]))
    features = torch.cat([network.encode(part) for part in torch.split(images, _ENCODED_AT_ONCE)])
    scores, lengths_m = [], []
    for source in range(len(home)):
        open_to = np.flatnonzero(home.explorable[source])
        goals = np.flatnonzero(~home.same_node[source])
        if len(open_to) < 2 or not len(goals):
            continue
        one = features[source].expand(len(goals), -1, -1)
        found = torch.sigmoid(network.pair(one, features[goals]).score).numpy()[:, open_to]
        true = home.score[source][np.ix_(goals, open_to)].astype(np.float32)
        length_m = -SCORE_LENGTH_M * np.log(np.maximum(true, _LEAST))
        rows = np.arange(len(goals))
        picks = (true.argmax(axis=1), found.argmax(axis=1), found.mean(axis=0).argmax())
        scores.append(np.stack([true.mean(axis=1), *(true[rows, pick] for pick in picks)], axis=1))
        lengths_m.append(
            np.stack([length_m.mean(axis=1), *(length_m[rows, pick] for pick in picks)], axis=1)
        )
    return np.concatenate(scores), np.concatenate(lengths_m).astype(np.float32)

"""Which episodes an evaluation runs: the first of each difficulty, spread over the buildings."""

from collections.abc import Sequence

from toponav.core.imagenav import Difficulty, ImageNavEpisode
from toponav.data.nts.episodes import load_episodes

__all__ = ["load_episode_set"]


def load_episode_set(
    suite_name: str, levels: Sequence[Difficulty], count: int
) -> tuple[ImageNavEpisode, ...]:
    """The first `count` frozen episodes of each difficulty.

    Raises:
        InputError: When the suite has none or fewer.
    """
    return tuple(
        episode for level in levels for episode in load_episodes(suite_name, level, count)
    )

"""Pairs of panoramas with their labels, in batches: the 6.1 million rows are never all there."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Int32, Int64

from toponav.core.errors import InputError
from toponav.core.imagenav import DIRECTIONS
from toponav.data.nts.labels import HomeLabels, direction_bins, score_of

__all__ = ["PairBatch", "PairStream"]


@dataclass(frozen=True, eq=False)
class PairBatch:
    """Some pairs of a source and a goal in the same home.

    Attributes:
        home: Number of the home.
        source: Number of the source's panorama in its home.
        goal: Number of the goal's panorama in its home.
        same_node: F_L: whether the goal is in the source's node.
        bearing_rad: F_R: direction of the goal from the source's heading.
        direction: The bin of that direction.
        distance_m: F_R: straight distance between them.
        geodesic_m: Length of the shortest path between them.
        explorable: F_G: whether there is something to explore in each direction.
        score: F_S: how fast the goal is reached in each direction; 0 where not explorable.
    """

    home: Int32[np.ndarray, " pairs"]
    source: Int32[np.ndarray, " pairs"]
    goal: Int32[np.ndarray, " pairs"]
    same_node: Bool[np.ndarray, " pairs"]
    bearing_rad: Float32[np.ndarray, " pairs"]
    direction: Int64[np.ndarray, " pairs"]
    distance_m: Float32[np.ndarray, " pairs"]
    geodesic_m: Float32[np.ndarray, " pairs"]
    explorable: Bool[np.ndarray, "pairs 12"]
    score: Float32[np.ndarray, "pairs 12"]

    def __len__(self) -> int:
        return len(self.home)


class PairStream:
    """All pairs of panoramas of some homes, given out a batch at a time.

    Memory holds the homes' label tables (about 3.3 MB for a home of 300 panoramas) and a batch.

    Args:
        homes: The labels of each home.

    Example:
        >>> homes = [labels_of(home) for home in open_panoramas(folder)]  # doctest: +SKIP
        >>> stream = PairStream(homes)  # doctest: +SKIP
        >>> batch = next(stream.random(256, np.random.default_rng(0)))  # doctest: +SKIP
    """

    def __init__(self, homes: Sequence[HomeLabels]) -> None:
        if not homes or not all(len(home) for home in homes):
            raise InputError(
                "pairs need at least one home, and every home a panorama",
                where="PairStream",
                remedy="run toponav collect nts",
            )
        self.homes = tuple(homes)
        self._pairs = np.array([len(home) ** 2 for home in homes], np.int64)
        self._first = np.concatenate([[0], np.cumsum(self._pairs)])
        self._same = [np.flatnonzero(home.same_node) for home in homes]
        self._other = [np.flatnonzero(~home.same_node) for home in homes]

    def __len__(self) -> int:
        """How many pairs there are."""
        return int(self._first[-1])

    @property
    def same_node_fraction(self) -> float:
        """The fraction of pairs that are of one node."""
        return sum(len(same) for same in self._same) / len(self)

    def in_order(self, size: int) -> Iterator[PairBatch]:
        """Every pair once, home by home."""
        for first in range(0, len(self), size):
            yield self._rows(np.arange(first, min(first + size, len(self))))

    def random(
        self, size: int, rng: np.random.Generator, same_node_fraction: float | None = 0.5
    ) -> Iterator[PairBatch]:
        """Random batches without end.

        Args:
            size: Pairs in a batch.
            rng: Where randomness comes from.
            same_node_fraction: Fraction of pairs of one node, which are about one in ten
                among all; None leaves them as they come.

        Raises:
            InputError: If the fraction is not within 0..1.
        """
        if same_node_fraction is not None and not 0 <= same_node_fraction <= 1:
            raise InputError(
                f"same_node_fraction must lie in 0..1, got {same_node_fraction}",
                where="PairStream.random",
                remedy="0.5 balances the two kinds",
            )
        share = self._pairs / self._pairs.sum()
        while True:
            if same_node_fraction is None:
                yield self._rows(rng.integers(len(self), size=size))
                continue
            home = rng.choice(len(self.homes), size=size, p=share)
            wants_same = rng.random(size) < same_node_fraction
            draw = rng.random(size)
            rows = np.empty(size, np.int64)
            for row in range(size):
                same, other = self._same[home[row]], self._other[home[row]]
                pool = same if wants_same[row] or not len(other) else other
                rows[row] = self._first[home[row]] + pool[int(draw[row] * len(pool))]
            yield self._rows(rows)

    def _rows(self, rows: Int64[np.ndarray, " pairs"]) -> PairBatch:
        home = np.searchsorted(self._first, rows, side="right") - 1
        count = np.array([len(one) for one in self.homes])[home]
        source, goal = np.divmod(rows - self._first[home], count)
        columns: dict[str, np.ndarray] = {
            "same_node": np.empty(len(rows), bool),
            "bearing_rad": np.empty(len(rows), np.float32),
            "distance_m": np.empty(len(rows), np.float32),
            "geodesic_m": np.empty(len(rows), np.float32),
            "explorable": np.empty((len(rows), DIRECTIONS), bool),
            "score": np.empty((len(rows), DIRECTIONS), np.float32),
        }
        for number in np.unique(home):
            of_home = home == number
            labels, at = self.homes[number], (source[of_home], goal[of_home])
            for name in ("same_node", "bearing_rad", "distance_m", "geodesic_m"):
                columns[name][of_home] = getattr(labels, name)[at]
            columns["explorable"][of_home] = labels.explorable[at[0]]
            columns["score"][of_home] = score_of(labels.via_m[at])
        bins = direction_bins(columns["bearing_rad"])
        return PairBatch(
            home=home.astype(np.int32),
            source=source.astype(np.int32),
            goal=goal.astype(np.int32),
            direction=bins,
            **columns,
        )

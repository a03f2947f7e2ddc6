"""Where the goal is: found from afar, checked while coming closer, and the decision to stop."""

import math
from dataclasses import dataclass

from toponav.core.geometry import Pose2
from toponav.navigation.nts.perception import Perception, View
from toponav.navigation.nts.registration import Registration, align, register

__all__ = ["FinderConfig", "GoalFinder", "finder_of"]

_DOUBTS = 3


@dataclass(frozen=True)
class FinderConfig:
    """When the goal counts as found, as reached, and as a mistake."""

    reach_m: float = 5.5
    """The goal is looked for this far from the robot."""
    found: float = 0.4
    """Agreement from which on a place is worth a closer look, if two looks agree on it."""
    clear: float = 0.56
    """Agreement for which one look is enough."""
    glimpse_m: float = 0.4
    """Looks agree on places that are so near one another."""
    sure_m: float = 2.6
    """So near, with nothing in between, a place has to agree better, or it was a mistake."""
    sure: float = 0.47
    """Agreement that it needs there."""
    network_share: float = 0.15
    """What a confident F_L adds to the agreement, or takes from it."""
    network_m: float = 2.5
    """F_L, which learned nodes of 3 m, has that say about places so near, and none about those a
    metre farther."""
    network_pull: float = 0.1
    """How much better a place a metre away from where F_R has the goal has to agree, where F_L
    is confident."""
    near_m: float = 1.0
    """Nearer than this, the goal has to look right."""
    near: float = 0.64
    """Agreement that it needs there."""
    stop_m: float = 0.7
    """Stop within this distance."""
    doubt: float = 0.1
    """Places that fall short of `found` by up to this are kept for when all else is explored."""
    every_steps: int = 2
    """The goal is looked for everywhere in so many steps."""
    moved_m: float = 0.1
    """A robot that only turned sees nothing new: it looks again after moving so far."""
    mistake_m: float = 0.8
    """Places within this distance of a mistake are mistakes."""
    confirmations: int = 2
    """Steps in which the goal has to look right from near by before stopping."""


def finder_of(depth: bool) -> FinderConfig:
    """Thresholds for a depth camera, or for predicted ranges, which agree less."""
    if depth:
        return FinderConfig()
    return FinderConfig(
        reach_m=4.0,
        found=0.52,
        clear=0.52,
        sure_m=0.0,
        network_share=0.3,
        network_m=9.0,
        network_pull=0.25,
        near=0.62,
        stop_m=0.55,
        doubt=0.14,
    )


class GoalFinder:
    """Looks for the place of the goal's picture around the robot.

    Other agents use it as it is: give it each view with `look`, drive to `place`, and stop when
    `has_arrived`.

    Args:
        perception: The network's functions.
        goal: The goal's view.
        config: Thresholds; those of the network's modality when left out.
    """

    def __init__(
        self, perception: Perception, goal: View, config: FinderConfig | None = None
    ) -> None:
        self.config = config or finder_of(perception.depth)
        self.goal = goal
        self.place: Pose2 | None = None
        self.score = 0.0
        self.has_arrived = False
        self._perception = perception
        self._mistakes: list[tuple[Pose2, float]] = []
        self._doubtful: list[tuple[float, Pose2]] = []
        self._looked: Pose2 | None = None
        self._seen_near = 0
        self._missed_near = 0
        self._is_sure = False
        self._doubted: list[Pose2] = []
        self._glimpses: list[Pose2] = []

    def look(self, view: View, pose: Pose2, step: int) -> Pose2 | None:
        """Where the goal is, in the frame of the start, after another view; None if unknown."""
        if self.place is not None:
            self._check(view, pose)
        is_close = self.place is not None and pose.distance_to(self.place) < self.config.near_m
        has_moved = self._looked is None or pose.distance_to(self._looked) > self.config.moved_m
        if not is_close and has_moved and step % self.config.every_steps == 0:
            self._looked = pose
            self._search(view, pose)
        return self.place

    def consider(self, view: View, pose: Pose2) -> bool:
        """Looks from another place, such as a node of the map; whether the goal is there."""
        before = self.place
        self._search(view, pose)
        return self.place is not before

    def give_up(self) -> None:
        """The place cannot be reached or is wrong: look elsewhere."""
        if self.place is not None:
            self._mistakes.append((self.place, self.score))
        self.set_aside()

    def set_aside(self) -> None:
        """The place cannot be reached so far, which says nothing against it: look elsewhere."""
        self.place, self.score = None, 0.0
        self._seen_near = self._missed_near = 0
        self._is_sure, self._doubted = False, []

    def take_best_guess(self) -> bool:
        """Takes the best of the doubtful places for the goal's; whether there was one left."""
        self._doubtful.sort(key=lambda one: one[0])
        while self._doubtful:
            score, place = self._doubtful.pop()
            if not self._is_mistake(place, score):
                self._believe(place, score)
                return True
        return False

    def _search(self, view: View, pose: Pose2) -> None:
        config = self.config
        pair = self._perception.compare([view], self.goal)
        chance = float(pair.connection[0])
        away_m, bearing = float(pair.distance_m[0]), float(pair.direction_rad[0])
        hint = (
            away_m * math.cos(bearing),
            away_m * math.sin(bearing),
            config.network_pull * chance,
        )
        found = register(view.signature, self.goal.signature, config.reach_m, hint)
        score = self._agreement(found, chance)
        place = pose.compose(found.pose)
        if score > config.found and score > self.score and not self._is_mistake(place, score):
            if score > config.clear or self._was_glimpsed(place):
                self._believe(place, score)
            else:
                self._remember(place, score)
            self._glimpses = [*self._glimpses[-3:], place]
        elif config.found - config.doubt < score <= config.found:
            self._remember(place, score)

    def _agreement(self, found: Registration, chance: float) -> float:
        """What registration and F_L say together."""
        away_m = math.hypot(found.pose.x_m, found.pose.y_m)
        say = min(max(self.config.network_m + 1.0 - away_m, 0.0), 1.0)
        return found.score + self.config.network_share * say * (2.0 * chance - 1.0)

    def _check(self, view: View, pose: Pose2) -> None:
        """Looks again at the place believed, when it is near enough to be sure."""
        assert self.place is not None
        config = self.config
        if pose.distance_to(self.place) > config.reach_m:
            return
        found = align(view.signature, self.goal.signature, self.place.relative_to(pose))
        chance = float(self._perception.compare([view], self.goal).connection[0])
        found = Registration(found.pose, self._agreement(found, chance))
        away_m = math.hypot(found.pose.x_m, found.pose.y_m)
        if self._is_mistaken(found.score, view, pose):
            self.give_up()
            return
        if found.score >= min(self.score, config.near):
            self._take(found, pose)
        if pose.distance_to(self.place) > config.near_m:
            return
        if found.score >= config.near:
            self._missed_near = 0
            self._seen_near += 1
            self.has_arrived = self._seen_near >= config.confirmations and away_m < config.stop_m
            return
        self._missed_near += 1
        if self._missed_near >= 3 and pose.distance_to(self.place) < 0.6:
            self.give_up()

    def _was_glimpsed(self, place: Pose2) -> bool:
        """Whether one of the last looks took the same place for the goal's."""
        return any(place.distance_to(one) < self.config.glimpse_m for one in self._glimpses)

    def _believe(self, place: Pose2, score: float) -> None:
        """Takes a place for the goal's."""
        if self.place is None or place.distance_to(self.place) > self.config.mistake_m:
            self._is_sure, self._doubted = False, []
        self.place, self.score = place, score

    def _is_mistaken(self, score: float, view: View, pose: Pose2) -> bool:
        """Whether the place believed did not agree well enough, three times, from near by."""
        assert self.place is not None
        self._is_sure = self._is_sure or score >= self.config.sure
        if self._is_sure or pose.distance_to(self.place) > self.config.sure_m:
            return False
        seen = self.place.relative_to(pose)
        range_m = view.signature.range_m
        step = 2.0 * math.pi / len(range_m)
        sight_m = range_m[round(math.atan2(seen.y_m, seen.x_m) / step) % len(range_m)]
        is_hidden = sight_m < math.hypot(seen.x_m, seen.y_m)
        moved_m = self.config.moved_m
        if is_hidden or any(pose.distance_to(before) < moved_m for before in self._doubted):
            return False
        self._doubted.append(pose)
        return len(self._doubted) >= _DOUBTS

    def _take(self, found: Registration, pose: Pose2) -> None:
        self.place = pose.compose(found.pose)
        self.score = max(self.score, found.score)

    def _remember(self, place: Pose2, score: float) -> None:
        """Keeps a doubtful place; of several near one another the best."""
        near = [one for one in self._doubtful if one[1].distance_to(place) < 1.0]
        if all(score > before for before, _ in near):
            self._doubtful = [one for one in self._doubtful if one not in near]
            self._doubtful.append((score, place))

    def _is_mistake(self, place: Pose2, score: float) -> bool:
        return any(
            place.distance_to(one) < self.config.mistake_m and score < before + 0.1
            for one, before in self._mistakes
        )

"""The parts of `MetricGraphNavAgent` that can be set, or left out to see what they are worth."""

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Final

from toponav.core.errors import InputError, did_you_mean
from toponav.models.graphnav.metric.pose_filter import PoseFilterConfig
from toponav.navigation.graphnav.avoidance import AvoidanceConfig
from toponav.navigation.graphnav.detour import DetourConfig
from toponav.navigation.graphnav.hypotheses import HypothesesConfig
from toponav.navigation.graphnav.plan_keeping import PlanKeepingConfig
from toponav.navigation.graphnav.room_search import RoomSearchConfig

__all__ = ["PARTS", "MetricAgentConfig"]

PARTS: Final = ("avoidance", "hypotheses", "plan_keeping", "detours", "room_search")
"""What can be left out by name."""


@dataclass(frozen=True)
class MetricAgentConfig:
    """What surrounds the two networks.

    Attributes:
        pose_filter: Noise of the filter; None takes each correction whole (GraphNav without its
            particle filter).
        avoidance: How far to stay from obstacles; None drives as the network says.
        hypotheses: Where in the first room the robot may be; None begins with a single filter
            at the room's node.
        plan_keeping: How commands are bent towards the plan's own nodes; None leaves them.
        detours: When and how a robot that gets nowhere plans its way on; None never.
        room_search: How a robot that is lost in its first room looks around; None never. It needs
            hypotheses, and drives as on detours.
    """

    pose_filter: PoseFilterConfig | None = field(default_factory=PoseFilterConfig)
    avoidance: AvoidanceConfig | None = field(default_factory=AvoidanceConfig)
    hypotheses: HypothesesConfig | None = field(default_factory=HypothesesConfig)
    plan_keeping: PlanKeepingConfig | None = field(default_factory=PlanKeepingConfig)
    detours: DetourConfig | None = field(default_factory=DetourConfig)
    room_search: RoomSearchConfig | None = field(default_factory=RoomSearchConfig)

    def without(self, parts: Collection[str]) -> "MetricAgentConfig":
        """The same without some parts.

        Raises:
            InputError: There is no such part.
        """
        for part in parts:
            if part not in PARTS:
                raise InputError(
                    f"the agent has no part '{part}'",
                    where="MetricAgentConfig",
                    remedy=did_you_mean(part, PARTS),
                )
        return replace(self, **dict.fromkeys(parts))

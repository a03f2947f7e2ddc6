"""Qualities of service, in one place."""

from typing import Final

from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)

__all__ = ["COMMAND", "LATCHED", "RELIABLE", "SENSOR", "SENSOR_KEPT"]

SENSOR: Final = qos_profile_sensor_data
"""Best effort: a late image is worth nothing."""
SENSOR_KEPT: Final = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=50, reliability=ReliabilityPolicy.BEST_EFFORT
)
"""For who wants every image, late or not."""
RELIABLE: Final = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=10)
COMMAND: Final = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=1)
LATCHED: Final = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""Whoever comes late gets the last message."""

"""A client of FollowPlan, for people. Call `toponav.ros.runtime.start` before importing this."""

import time
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.action import ActionClient
from toponav_msgs.action import FollowPlan

from toponav.core.errors import InputError

__all__ = ["go"]


def go(
    start: str,
    goal: str,
    *,
    seed: int = 0,
    timeout_s: float = 30.0,
    on_feedback: Callable[[str], None] = lambda _: None,
) -> dict[str, Any]:
    """How a drive ended, once it has. Ctrl-C cancels it first.

    Raises:
        InputError: No agent is there.
    """
    node = rclpy.create_node("toponav_go")
    client = ActionClient(node, FollowPlan, "follow_plan")
    if not client.wait_for_server(timeout_sec=timeout_s):
        raise InputError(
            f"no agent has offered the action follow_plan for {timeout_s:g} s",
            where="toponav ros go",
            remedy="start `toponav ros agent`, with the same ROS_DOMAIN_ID",
        )
    last = ""
    told_s = 0.0

    def show(message: Any) -> None:
        nonlocal last, told_s
        said = message.feedback
        line = f"{said.progress:4.0%}  {said.node:<24} {said.stopped_because or said.behavior}"
        if line != last and time.monotonic() - told_s > 0.5:
            last, told_s = line, time.monotonic()
            on_feedback(line)

    request = FollowPlan.Goal(start_node=start, goal=goal, seed=seed)
    sending = client.send_goal_async(request, feedback_callback=show)
    rclpy.spin_until_future_complete(node, sending)
    handle = sending.result()
    waiting = handle.get_result_async()
    try:
        rclpy.spin_until_future_complete(node, waiting)
    except KeyboardInterrupt:
        cancelling = handle.cancel_goal_async()
        rclpy.spin_until_future_complete(node, cancelling, timeout_sec=5.0)
        rclpy.spin_until_future_complete(node, waiting, timeout_sec=5.0)
    done = waiting.result()
    node.destroy_node()
    if done is None:
        return {"success": False, "outcome": "cancelled", "reason": "no answer", "progress": 0.0}
    result = done.result
    return {
        "success": result.success,
        "outcome": result.outcome,
        "reason": result.reason,
        "node": result.node,
        "progress": result.progress,
        "steps": result.steps,
    }

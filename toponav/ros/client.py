"""Clients of the actions, for people. Call `toponav.ros.runtime.start` before importing this."""

import time
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.action import ActionClient
from toponav_msgs.action import FollowPlan, GoToImage
from toponav_msgs.srv import Reset

from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import ImageGoal
from toponav.ros.panorama_node import PanoramaNode
from toponav.ros.pictures import fill_goal
from toponav.ros.presets import RobotPreset

__all__ = ["find", "go", "look", "put"]

_Show = Callable[[str], None]


def go(
    start: str,
    goal: str,
    *,
    seed: int = 0,
    timeout_s: float = 30.0,
    on_feedback: _Show = lambda _: None,
) -> dict[str, Any]:
    """How a drive ended, once it has. Ctrl-C cancels it first.

    Raises:
        InputError: No agent is there.
    """

    def line(said: Any) -> str:
        return f"{said.progress:4.0%}  {said.node:<24} {said.stopped_because or said.behavior}"

    result = _drive(
        FollowPlan,
        "follow_plan",
        FollowPlan.Goal(start_node=start, goal=goal, seed=seed),
        timeout_s=timeout_s,
        show=_Told(line, on_feedback),
        remedy="start `toponav ros agent --map MAP`, with the same ROS_DOMAIN_ID",
    )
    if result is None:
        return {**_NO_ANSWER, "node": "", "progress": 0.0, "steps": 0}
    return {
        **_common(result),
        "node": result.node,
        "progress": result.progress,
        "steps": result.steps,
    }


def find(
    goal: ImageGoal,
    *,
    seed: int = 0,
    max_actions: int = 0,
    timeout_s: float = 30.0,
    on_feedback: _Show = lambda _: None,
) -> dict[str, Any]:
    """How the search for a picture's place ended, once it has. Ctrl-C cancels it first.

    Raises:
        InputError: No agent is there.
    """

    def line(said: Any) -> str:
        return f"{said.actions:4} actions, {said.nodes} nodes: {said.behavior}"

    result = _drive(
        GoToImage,
        "go_to_image",
        fill_goal(GoToImage.Goal(seed=seed, max_actions=max_actions), goal),
        timeout_s=timeout_s,
        show=_Told(line, on_feedback),
        remedy="start `toponav ros agent --image-agent nts_rgbd`, with the same ROS_DOMAIN_ID",
    )
    if result is None:
        return {**_NO_ANSWER, "actions": 0}
    return {**_common(result), "actions": result.actions}


def look(robot: RobotPreset, depth: bool, timeout_s: float) -> ImageGoal:
    """The panorama that a robot sees now, standing still.

    Raises:
        InputError: None comes, with odometry, in time.
    """
    node = PanoramaNode(robot, depth, False, "toponav_picture")
    node.begin()
    seen = node.look(0.0, timeout_s, lambda: not rclpy.ok())
    node.close()
    node.destroy_node()
    if seen is None:
        topics = [robot.rgb, *([robot.depth] if depth else []), robot.odom]
        raise InputError(
            f"nothing came for {timeout_s:g} s on all of {', '.join(topics)} from a robot at rest",
            where="toponav ros picture",
            remedy="start the robot, or `toponav ros sim --panorama`",
        )
    return ImageGoal(seen.rgb, seen.depth_m)


def put(pose: Pose2, timeout_s: float) -> None:
    """Put the simulated robot down somewhere else.

    Raises:
        InputError: There is no simulator, or it refuses the pose.
    """
    node = rclpy.create_node("toponav_put")
    client = node.create_client(Reset, "/toponav_sim/reset")
    try:
        waiting = None
        if client.wait_for_service(timeout_sec=timeout_s):
            waiting = client.call_async(Reset.Request(x=pose.x_m, y=pose.y_m, yaw=pose.yaw_rad))
            rclpy.spin_until_future_complete(node, waiting, timeout_sec=timeout_s)
        if waiting is None or not waiting.done():
            raise InputError(
                f"no simulator has answered for {timeout_s:g} s",
                where="toponav ros put",
                remedy="start `toponav ros sim`, with the same ROS_DOMAIN_ID",
            )
        answer = waiting.result()
        if not answer.success:
            raise InputError(answer.message, where="toponav ros put", remedy="give another pose")
    finally:
        node.destroy_node()


class _Told:
    """Shows feedback as lines, twice a second at most, and none twice."""

    def __init__(self, line: Callable[[Any], str], show: _Show) -> None:
        self._line, self._show = line, show
        self._last, self._at_s = "", 0.0

    def __call__(self, message: Any) -> None:
        line = self._line(message.feedback)
        if line != self._last and time.monotonic() - self._at_s > 0.5:
            self._last, self._at_s = line, time.monotonic()
            self._show(line)


_NO_ANSWER = {"success": False, "outcome": "cancelled", "reason": "no answer"}


def _common(result: Any) -> dict[str, Any]:
    return {"success": result.success, "outcome": result.outcome, "reason": result.reason}


def _drive(
    action: Any, name: str, goal: Any, *, timeout_s: float, show: _Told, remedy: str
) -> Any:
    """The action's result, or None where a cancelled drive gave no answer."""
    node = rclpy.create_node("toponav_go")
    client = ActionClient(node, action, name)
    try:
        if not client.wait_for_server(timeout_sec=timeout_s):
            raise InputError(
                f"no agent has offered the action {name} for {timeout_s:g} s",
                where="toponav ros",
                remedy=remedy,
            )
        sending = client.send_goal_async(goal, feedback_callback=show)
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
        return None if done is None else done.result
    finally:
        client.destroy()
        node.destroy_node()

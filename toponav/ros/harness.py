"""The simulator in this process and an agent in another, for tests and benchmarks.

Call `toponav.ros.runtime.start` before importing this.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from rclpy.action import ActionClient
from toponav_msgs.action import FollowPlan

from toponav.core.geometry import Pose2
from toponav.maps.plan import Plan
from toponav.ros.sim_node import SimNode, SimNodeConfig, StepSeen
from toponav.sim.simulation import Simulation

__all__ = ["AgentProcess", "Harness", "pin_threads"]

_START_S = 300.0


class AgentProcess:
    """`toponav ros agent` as a child.

    Args:
        arguments: Its options.
        log: Where what it prints goes.
    """

    def __init__(self, arguments: Sequence[str], log: Path) -> None:
        self._log: IO[bytes] = log.open("wb")
        command = [sys.executable, "-m", "toponav.cli.main", "ros", "agent", *arguments]
        self.process = subprocess.Popen(command, stdout=self._log, stderr=subprocess.STDOUT)

    def kill(self) -> None:
        """SIGKILL: it has no time for a last command."""
        self.process.kill()
        self.process.wait(10.0)

    def resident_kib(self) -> int:
        """Memory that it holds now."""
        with suppress(OSError):
            for line in Path(f"/proc/{self.process.pid}/status").read_text().splitlines():
                if line.startswith("VmRSS:"):
                    return int(line.split()[1])
        return 0

    def close(self) -> None:
        """End it, politely at first."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(10.0)
        if self.process.poll() is None:
            self.kill()
        self._log.close()


class Harness:
    """Drives plan after plan through ROS.

    Args:
        simulation: Where the robot drives.
        start: Where it stands at first.
        config: How the simulator behaves.
        agent: Options of `toponav ros agent`.
        log: Where the agent's output goes.
    """

    def __init__(
        self,
        simulation: Simulation,
        start: Pose2,
        config: SimNodeConfig,
        agent: Sequence[str],
        log: Path,
    ) -> None:
        self._watchers: list[Callable[[StepSeen], None]] = []
        self.node = SimNode(simulation, start, config, self._show)
        self._client = ActionClient(self.node, FollowPlan, "follow_plan")
        self.agent = AgentProcess([*agent, "--sim-time"], log)

    def __enter__(self) -> "Harness":
        try:
            self.node.run(self._is_ready_or_late(time.monotonic() + _START_S))
        except BaseException:
            self.agent.close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.agent.close()
        self._client.destroy()
        self.node.destroy_node()

    def drive(
        self,
        plan: Plan,
        start: Pose2,
        *,
        seed: int = 0,
        until: Callable[[], bool] = lambda: False,
        until_cancelled: bool = True,
        on_step: Callable[[StepSeen], None] = lambda _: None,
    ) -> Any:
        """The action's result after a drive, or None where the agent is no more.

        Args:
            plan: What to follow.
            start: Where the robot is put down.
            seed: Seed of the agent.
            until: The drive is cancelled once this holds.
            until_cancelled: Whether reaching the goal does not end it.
            on_step: Called after every tick, or step where in lock-step.
        """
        self.node.reset(start)
        request = FollowPlan.Goal(
            nodes=list(plan.nodes), seed=seed, until_cancelled=until_cancelled
        )
        self._watchers = [on_step]
        try:
            sending = self._client.send_goal_async(request)
            self.node.run(lambda: sending.done() or until() or self._agent_is_dead())
            if not sending.done():
                return None
            handle = sending.result()
            waiting = handle.get_result_async()
            self.node.run(lambda: waiting.done() or until() or self._agent_is_dead())
        finally:
            self._watchers = []
        if not waiting.done() and not self._agent_is_dead():
            cancelling = handle.cancel_goal_async()
            self.node.run(lambda: waiting.done() or self._agent_is_dead())
            del cancelling
        return waiting.result().result if waiting.done() else None

    def watch(self, on_step: Callable[[StepSeen], None]) -> None:
        """Show every tick to this, until the next drive."""
        self._watchers = [on_step]

    def _show(self, seen: StepSeen) -> None:
        for watcher in self._watchers:
            watcher(seen)

    def _agent_is_dead(self) -> bool:
        return self.agent.process.poll() is not None

    def _is_ready_or_late(self, end_s: float) -> Callable[[], bool]:
        def is_ready() -> bool:
            if self._client.server_is_ready():
                return True
            if self._agent_is_dead() or time.monotonic() > end_s:
                raise RuntimeError(f"the agent did not start, see {self.agent._log.name}")
            return False

        return is_ready


def pin_threads() -> None:
    """One thread a process: two processes on two cores, and the same sums in both."""
    import torch

    torch.set_num_threads(1)
    os.environ["OMP_NUM_THREADS"] = "1"

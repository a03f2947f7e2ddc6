"""The simulator in this process and an agent in another, for tests and benchmarks.

Call `toponav.ros.runtime.start` before importing this.
"""

import dataclasses
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

from toponav.core.episode import Velocity
from toponav.core.geometry import Pose2
from toponav.maps.plan import Plan
from toponav.ros.faults import parse_faults
from toponav.ros.sim_node import SimNode, SimNodeConfig, StepSeen
from toponav.sim.simulation import SimState, Simulation

__all__ = ["ControlSteps", "Harness", "RosProcess", "pin_threads"]

_START_S = 900.0
_AGENT = "toponav_agent"


class RosProcess:
    """A `toponav ros` command as a child.

    Args:
        words: Its words after `toponav ros`.
        log: Where what it prints goes.
    """

    def __init__(self, words: Sequence[str], log: Path) -> None:
        self._log: IO[bytes] = log.open("wb")
        command = [sys.executable, "-m", "toponav.cli.main", "ros", *words]
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

    def is_over(self) -> bool:
        """Whether it has ended."""
        return self.process.poll() is not None

    def interrupt(self) -> None:
        """What Ctrl-C does, by SIGTERM: children of a background shell never see a Ctrl-C."""
        self.process.send_signal(signal.SIGTERM)

    def close(self) -> None:
        """End it, politely at first."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(10.0)
        if self.process.poll() is None:
            self.kill()
        self._log.close()


class ControlSteps:
    """Makes control steps of ticks: shows the last command and state, and any touch.

    Args:
        on_step: Called after every 0.2 s.
    """

    def __init__(self, on_step: Callable[[Velocity, SimState], None]) -> None:
        self._on_step = on_step
        self._contact: str | None = None

    def __call__(self, seen: StepSeen) -> None:
        """A tick has passed."""
        self._contact = self._contact or seen.state.contact
        if seen.ends_step:
            contact, self._contact = self._contact, None
            self._on_step(seen.command, seen.state._replace(contact=contact))


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
        self._config, self._log = config, log
        self._words = ["agent", *agent, "--sim-time"]
        self.node = SimNode(simulation, start, config, self._show)
        self._client = ActionClient(self.node, FollowPlan, "follow_plan")
        self.agent = RosProcess(self._words, log)

    def __enter__(self) -> "Harness":
        try:
            self._await_agent()
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
            on_step: Called after every tick.
        """
        self.node.reset(start)
        request = FollowPlan.Goal(
            nodes=list(plan.nodes), seed=seed, until_cancelled=until_cancelled
        )
        self._watchers = [on_step]
        try:
            # In lock-step time begins with the goal, also where the first picture comes late.
            self.node.paused = self.node.config.lockstep
            sending = self._client.send_goal_async(request)
            self.node.run(lambda: sending.done() or until() or self._agent_is_dead())
            self.node.paused = False
            if not sending.done():
                return None
            handle = sending.result()
            waiting = handle.get_result_async()
            self.node.run(lambda: waiting.done() or until() or self._agent_is_dead())
        finally:
            self._watchers = []
            self.node.paused = False
        if not waiting.done() and not self._agent_is_dead():
            cancelling = handle.cancel_goal_async()
            self.node.run(lambda: waiting.done() or self._agent_is_dead())
            del cancelling
        return waiting.result().result if waiting.done() else None

    def ask(self, **goal: Any) -> Any:
        """The action's result of a goal that is not driven to."""
        sending = self._client.send_goal_async(FollowPlan.Goal(**goal))
        self.node.run(lambda: sending.done() or self._agent_is_dead())
        waiting = sending.result().get_result_async()
        self.node.run(lambda: waiting.done() or self._agent_is_dead())
        return waiting.result().result

    def break_camera(
        self, *faults: str, rate: float, period_s: float = 10.0, at_s: float | None = None
    ) -> None:
        """The camera is faulty from the next picture on.

        Args:
            faults: As `toponav ros sim --fault` takes them.
            rate: Simulated seconds per second, at most.
            period_s: Spells begin so often.
            at_s: When the first spell begins; left out, after half a period.
        """
        spec = parse_faults(faults)
        begins_s = period_s / 2 if at_s is None else at_s
        spec = dataclasses.replace(spec, period_s=period_s, begins_s=begins_s)
        self._configure(faults=spec, rate=rate)

    def limit(self, rate: float) -> None:
        """Time passes at most so fast, for those who only listen."""
        self._configure(rate=rate)

    def is_listened_to(self, node: str) -> bool:
        """Whether a node of that name hears this robot's pictures."""
        topic = self.node.config.robot.depth
        hears = self.node.get_subscriptions_info_by_topic(topic)
        return any(each.node_name == node for each in hears)

    def let_go(self, rate: float = 0.0) -> None:
        """Time waits for nobody from now on."""
        self._configure(lockstep=False, rate=rate)

    def restore(self) -> None:
        """The simulator as it was configured at first."""
        self.node.configure(self._config)

    def revive(self) -> None:
        """A new agent where the last one is no more."""
        if self._agent_is_dead():
            self.agent.close()
            self.agent = RosProcess(self._words, self._log)
            self._await_agent()

    def agent_log(self) -> str:
        """The end of what the agent printed."""
        return self._log.read_text(errors="replace")[-2000:]

    def watch(self, on_step: Callable[[StepSeen], None]) -> None:
        """Show every tick to this, until the next drive."""
        self._watchers = [on_step]

    def _show(self, seen: StepSeen) -> None:
        for watcher in self._watchers:
            watcher(seen)

    def _agent_is_dead(self) -> bool:
        return self.agent.process.poll() is not None

    def _configure(self, **changes: Any) -> None:
        self.node.configure(dataclasses.replace(self.node.config, **changes))

    def _await_agent(self) -> None:
        end_s = time.monotonic() + _START_S
        self.node.run(
            lambda: self._is_ready() or self._agent_is_dead() or time.monotonic() > end_s
        )
        if not self._is_ready():
            raise RuntimeError(f"the agent did not start:\n{self.agent_log()}")

    def _is_ready(self) -> bool:
        # An agent that was killed stays in the list of nodes until DDS gives it up.
        return bool(
            "is ready" in self.agent_log()
            and self.node.get_node_names().count(_AGENT) == 1
            and self._client.server_is_ready()
        )


def pin_threads() -> None:
    """One thread a process: two processes on two cores, and the same sums in both."""
    import torch

    torch.set_num_threads(1)
    os.environ["OMP_NUM_THREADS"] = "1"

"""Robots in processes of their own, as stable-baselines3 wants them; pictures in shared memory."""

import itertools
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any

import gymnasium
import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from toponav.core.errors import InputError
from toponav.core.imagenav import Action
from toponav.models.baselines.image_goal_presets import ImageGoalConfig
from toponav.training.image_goals.homes import HomeShelf
from toponav.training.image_goals.rollouts import Robots, RolloutSettings, observation_space

__all__ = ["RobotProcesses"]

_Shapes = dict[str, tuple[tuple[int, ...], str]]


class RobotProcesses(VecEnv):
    """All robots; what they do does not depend on the number of processes.

    Args:
        config: The network's.
        settings: What episodes are drawn from.
        robots: How many.
        processes: Processes that simulate them; 0 simulates here.
        seed: Seed of the episodes.
        reward_scale: Factor on rewards, which changes no policy, but how fast one is learned.
        shelf: Other buildings than the settings say; simulated here.
    """

    def __init__(
        self,
        config: ImageGoalConfig,
        settings: RolloutSettings,
        robots: int,
        processes: int,
        seed: int = 0,
        reward_scale: float = 1.0,
        shelf: HomeShelf | None = None,
    ) -> None:
        space = observation_space(config)
        super().__init__(robots, space, gymnasium.spaces.Discrete(len(Action)))
        self._segment, self._far_m = 0, 10.0
        self._reward_scale = reward_scale
        shapes: _Shapes = {
            name: ((robots, *one.shape), str(one.dtype))
            for name, one in space.spaces.items()
            if one.shape is not None
        }
        context = multiprocessing.get_context("spawn")
        memory = {
            name: context.RawArray("b", int(np.prod(shape)) * np.dtype(dtype).itemsize)
            for name, (shape, dtype) in shapes.items()
        }
        self._now = _arrays(memory, shapes)
        self._actions = np.zeros(robots, np.int64)
        parts = _parts(robots, max(processes, 1))
        self._parts = parts
        self._here = Robots(config, settings, parts[0], seed, shelf) if not processes else None
        self._pipes: list[Connection] = []
        self._processes: list[Any] = []
        for part in parts if processes else []:
            ours, theirs = context.Pipe()
            process = context.Process(
                target=_simulate,
                args=(theirs, memory, shapes, config, settings, part, seed, os.getpid()),
                daemon=True,
            )
            process.start()
            theirs.close()
            self._pipes.append(ours)
            self._processes.append(process)

    def begin(self, segment: int, far_m: float) -> None:
        """The next `reset` begins this segment, with goals nearer than this."""
        self._segment, self._far_m = segment, far_m

    def reset(self) -> dict[str, np.ndarray]:
        """What all robots sense at the start of the segment."""
        if self._here is not None:
            _write(self._now, self._parts[0], self._here.reset(self._segment, self._far_m))
        for pipe in self._pipes:
            pipe.send(("reset", self._segment, self._far_m))
        for pipe in self._pipes:
            self._answer(pipe)
        return self._observed()

    def step_async(self, actions: np.ndarray) -> None:
        """Sends the actions."""
        self._actions = actions
        for part, pipe in zip(self._parts, self._pipes, strict=False):
            pipe.send(("step", actions[part.start : part.stop]))

    def step_wait(self) -> tuple[Any, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """What came of them."""
        if self._here is not None:
            sensed = self._here.step(self._actions)
            _write(self._now, self._parts[0], [one.inputs for one in sensed])
            answers = [[(one.reward, one.is_over, one.info) for one in sensed]]
        else:
            answers = [self._answer(pipe) for pipe in self._pipes]
        told = [one for answer in answers for one in answer]
        rewards = np.array([self._reward_scale * reward for reward, _, _ in told], np.float32)
        over = np.array([is_over for _, is_over, _ in told])
        return self._observed(), rewards, over, [info for _, _, info in told]

    def close(self) -> None:
        """Ends the processes."""
        for pipe in self._pipes:
            try:
                pipe.send(("close",))
            except OSError:
                continue
        for process in self._processes:
            process.join(timeout=5)
            if process.is_alive():
                process.terminate()
        self._pipes, self._processes = [], []

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Only what stable-baselines3 asks for: nothing is drawn."""
        return [None] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Robots in other processes have no attributes to set."""
        raise NotImplementedError

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Robots in other processes have no methods to call."""
        raise NotImplementedError

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """Nothing is wrapped."""
        return [False] * len(list(self._get_indices(indices)))

    def _observed(self) -> dict[str, np.ndarray]:
        return {name: value.copy() for name, value in self._now.items()}

    def _answer(self, pipe: Connection) -> Any:
        try:
            answer = pipe.recv()
        except EOFError:
            raise InputError(
                "a process that simulates robots ended",
                where="--workers",
                remedy="run the same command again: it goes on from the last checkpoint. Give "
                "fewer workers or robots if memory ran out",
            ) from None
        if isinstance(answer, tuple):
            rule, where, remedy = answer
            raise InputError(rule, where=where, remedy=remedy)
        return answer


def _parts(robots: int, processes: int) -> list[range]:
    edges = np.linspace(0, robots, min(processes, robots) + 1).round().astype(int).tolist()
    return [range(first, end) for first, end in itertools.pairwise(edges)]


def _arrays(memory: dict[str, Any], shapes: _Shapes) -> dict[str, np.ndarray]:
    return {
        name: np.frombuffer(memory[name], dtype).reshape(shape)
        for name, (shape, dtype) in shapes.items()
    }


def _write(
    arrays: dict[str, np.ndarray], part: range, inputs: Sequence[dict[str, np.ndarray]]
) -> None:
    for name, array in arrays.items():
        for number, one in zip(part, inputs, strict=True):
            array[number] = one[name]


def _simulate(
    pipe: Connection,
    memory: dict[str, Any],
    shapes: _Shapes,
    config: ImageGoalConfig,
    settings: RolloutSettings,
    part: range,
    seed: int,
    parent: int,
) -> None:
    """What a process does: simulates its robots until it is told to end, or its parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    arrays = _arrays(memory, shapes)
    robots = Robots(config, settings, part, seed)
    while True:
        try:
            command, *given = pipe.recv()
        except EOFError:
            return
        if command == "close":
            return
        try:
            if command == "reset":
                _write(arrays, part, robots.reset(*given))
                pipe.send([])
            else:
                sensed = robots.step(*given)
                _write(arrays, part, [one.inputs for one in sensed])
                pipe.send([(one.reward, one.is_over, one.info) for one in sensed])
        except InputError as error:
            pipe.send((error.rule, error.where, error.remedy))


def _end_with(parent: int) -> None:
    """A killed training leaves no processes behind."""
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)

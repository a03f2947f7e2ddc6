"""Where independent tasks run: here, in processes of this machine, or on a Ray cluster."""

from collections.abc import Callable, Hashable, Sequence
from typing import Any, Literal, TypeVar

from toponav.data.parallel import run_parallel

__all__ = ["Engine", "run_tasks"]

Engine = Literal["local", "ray"]
"""`local`: processes of this machine. `ray`: the cluster that `RAY_ADDRESS` names, else one that
is started here for as long as it is needed."""

Task = TypeVar("Task")
Result = TypeVar("Result")


def run_tasks(
    function: Callable[[Task], Result],
    tasks: Sequence[Task],
    workers: int,
    *,
    engine: Engine = "local",
    affinity: Callable[[Task], Hashable] | None = None,
    on_result: Callable[[Task, Result], None] | None = None,
    on_poll: Callable[[int], None] | None = None,
) -> None:
    """Runs every task once and hands each result over as soon as it is there.

    Results depend on the tasks alone, so every engine and number of workers gives the same. An
    error in a task stops the rest. On Ray, a task whose worker is killed runs again elsewhere.

    Args:
        function: Defined at the top of a module, as is all that is sent to a process.
        tasks: One call each.
        workers: Processes of this machine, or of the cluster.
        engine: Where to run them.
        affinity: A key of a task; tasks of the same key, such as the episodes of a home, run on
            one worker as long as there are others, so that each home is made once.
        on_result: Called here with each task and its result, in the order that they finish.
        on_poll: Told here how many tasks are done.

    Raises:
        InputError: From a task, or when a local worker was killed, or Ray is not installed.
    """
    deliver: Callable[[Any, Any], None] = on_result or (lambda task, result: None)
    if engine == "ray":
        from toponav.data.ray_engine import run_on_ray

        run_on_ray(function, tasks, workers, deliver, on_poll, affinity=affinity)
    else:
        run_parallel(function, tasks, workers, on_poll, on_result=deliver, affinity=affinity)

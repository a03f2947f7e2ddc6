"""Tasks on a Ray cluster: the same results as in local processes, and killed workers are replaced.

Ray sends functions and results between processes in its own way; nothing of it is stored. Without
`RAY_ADDRESS` a small cluster is started on this machine and ended again.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from toponav.core.errors import InputError
from toponav.data.parallel import Failure, guarded

__all__ = ["run_on_ray"]

_POLL_S = 0.5
_RETRIES = 5


def run_on_ray(
    function: Callable[[Any], Any],
    tasks: Sequence[Any],
    workers: int,
    deliver: Callable[[Any, Any], None],
    on_poll: Callable[[int], None] | None = None,
) -> None:
    """Runs every task once, so many at a time, and hands each result over when it is there.

    A task whose worker is killed runs again from its beginning on another; what other tasks have
    done or are doing is not touched.

    Args:
        function: Defined at the top of a module that every machine of the cluster has.
        tasks: One call each.
        workers: Tasks at a time.
        deliver: Called here with each task and its result, in the order that they finish.
        on_poll: Told here how many tasks are done.

    Raises:
        InputError: From a task, or when Ray is not installed, or the cluster was lost.
    """
    if not tasks:
        return
    with _cluster(workers) as ray:
        try:
            _run(ray, function, tasks, workers, deliver, on_poll or (lambda done: None))
        except ray.exceptions.RayError as error:
            raise InputError(
                f"the cluster could not finish: {type(error).__name__}",
                where="--engine ray",
                remedy="look at Ray's logs, then run the same command again to resume",
            ) from error


def _run(
    ray: Any,
    function: Callable[[Any], Any],
    tasks: Sequence[Any],
    workers: int,
    deliver: Callable[[Any, Any], None],
    poll: Callable[[int], None],
) -> None:
    remote = ray.remote(num_cpus=1, max_retries=_RETRIES)(guarded)
    waiting = list(enumerate(tasks))[::-1]
    running: dict[Any, int] = {}
    done = 0
    while waiting or running:
        # Few at a time: a task that waits would be sent to a worker that may be slow.
        while waiting and len(running) < workers:
            number, task = waiting.pop()
            running[remote.remote(function, task)] = number
        ready, _ = ray.wait(list(running), num_returns=1, timeout=_POLL_S)
        for reference in ready:
            number = running.pop(reference)
            result = ray.get(reference)
            if isinstance(result, Failure):
                raise InputError(result.rule, where=result.where, remedy=result.remedy)
            deliver(tasks[number], result)
            done += 1
        poll(done)


@contextmanager
def _cluster(workers: int) -> Iterator[Any]:
    """Ray, connected to the cluster in use, or to one of this machine's for the while."""
    try:
        import ray
    except ImportError:
        raise InputError(
            "the package ray is not installed",
            where="--engine ray",
            remedy="pip install 'toponav[ray]', or use --engine local",
        ) from None
    if ray.is_initialized():
        yield ray
        return
    settings: dict[str, Any] = {"log_to_driver": False, "logging_level": "error"}
    if not os.environ.get("RAY_ADDRESS"):
        settings |= {"num_cpus": workers, "include_dashboard": False}
    ray.init(**settings)
    try:
        yield ray
    finally:
        ray.shutdown()

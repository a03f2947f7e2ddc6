"""Tasks on a Ray cluster: the same results as in local processes, and killed workers are replaced.

Ray sends functions and results between processes in its own way; nothing of it is stored. Without
`RAY_ADDRESS` a small cluster is started on this machine and ended again.
"""

import os
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from toponav.core.errors import InputError
from toponav.data.dealing import Dealer
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
    *,
    affinity: Callable[[Any], Hashable] | None = None,
) -> None:
    """Runs every task once, so many at a time, and hands each result over when it is there.

    A task whose worker is killed runs again from its beginning on another; what other tasks have
    done or are doing is not touched.

    Args:
        function: Defined at the top of a module that every machine of the cluster has.
        tasks: One call each.
        workers: Tasks at a time, each in a process of its own that lasts until all are done.
        deliver: Called here with each task and its result, in the order that they finish.
        on_poll: Told here how many tasks are done.
        affinity: A key of a task; tasks of the same key run in one process, as `Dealer` says.

    Raises:
        InputError: From a task, or when Ray is not installed, or the cluster was lost.
    """
    if not tasks:
        return
    workers = min(workers, len(tasks))
    with _cluster(workers) as ray:
        crew = _Crew(ray, workers)
        try:
            _run(crew, function, tasks, Dealer(tasks, affinity), deliver, on_poll)
        except ray.exceptions.RayError as error:
            raise InputError(
                f"the cluster could not finish: {type(error).__name__}",
                where="--engine ray",
                remedy="look at Ray's logs, then run the same command again to resume",
            ) from error
        finally:
            crew.dismiss()


class _Worker:
    """A process of the cluster; it keeps what it has made, from task to task."""

    def is_ready(self) -> bool:
        """True once there is a processor for it."""
        return True

    def do(self, function: Callable[[Any], Any], task: Any) -> Any:
        """The function's result."""
        return guarded(function, task)


class _Crew:
    """The workers; one that is killed is replaced, and its task begins again."""

    def __init__(self, ray: Any, workers: int) -> None:
        self.ray = ray
        kind = ray.remote(num_cpus=1, max_restarts=-1, max_task_retries=_RETRIES)(_Worker)
        self._workers = [kind.remote() for _ in range(workers)]

    def ready(self) -> dict[Any, int]:
        """Promises that workers are there. A busy cluster may have no room for some yet."""
        return {worker.is_ready.remote(): k for k, worker in enumerate(self._workers)}

    def do(self, worker: int, function: Callable[[Any], Any], task: Any) -> Any:
        """The promise of a result."""
        return self._workers[worker].do.remote(function, task)

    def dismiss(self) -> None:
        """Ends the processes, whatever they are doing."""
        for worker in self._workers:
            self.ray.kill(worker)


def _run(
    crew: _Crew,
    function: Callable[[Any], Any],
    tasks: Sequence[Any],
    dealer: Dealer,
    deliver: Callable[[Any, Any], None],
    poll: Callable[[int], None] | None,
) -> None:
    free: dict[Any, int] = crew.ready()
    running: dict[Any, tuple[int, int]] = {}
    done = 0
    while done < len(tasks):
        ready, _ = crew.ray.wait([*free, *running], num_returns=1, timeout=_POLL_S)
        for promise in ready:
            result = crew.ray.get(promise)
            if isinstance(result, Failure):
                raise InputError(result.rule, where=result.where, remedy=result.remedy)
            worker, number = (
                running.pop(promise) if promise in running else (free.pop(promise), -1)
            )
            following = dealer.next(worker)
            if following is not None:
                promised = crew.do(worker, function, tasks[following])
                running[promised] = (worker, following)
            if number >= 0:
                deliver(tasks[number], result)
                done += 1
        if poll is not None:
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
    # Nothing is told to anyone unless its user has asked for it.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    settings: dict[str, Any] = {"log_to_driver": False, "logging_level": "error"}
    if not os.environ.get("RAY_ADDRESS"):
        settings |= {"num_cpus": workers, "include_dashboard": False}
    ray.init(**settings)
    try:
        yield ray
    finally:
        ray.shutdown()

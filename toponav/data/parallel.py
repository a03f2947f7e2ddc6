"""Work divided over processes that stop when they are told to, or when their parent is gone."""

import os
import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any, TypeVar

from toponav.core.errors import InputError

__all__ = ["check_workers", "run_parallel"]

Task = TypeVar("Task")
Result = TypeVar("Result")

_POLL_S = 0.5


@dataclass(frozen=True)
class _Failure:
    """An `InputError` on its way between processes."""

    rule: str
    where: str
    remedy: str


def check_workers(workers: int) -> None:
    """Nothing, if this machine can run so many processes.

    Raises:
        InputError: If there are none, or many more than processor cores: each takes a gigabyte.
    """
    most = max(16, 4 * (os.cpu_count() or 1))
    if not 1 <= workers <= most:
        raise InputError(
            f"workers must be 1 to {most} on this machine, got {workers}",
            where="--workers",
            remedy="give the number of processor cores to use",
        )


def run_parallel(
    function: Callable[[Task], Result],
    tasks: Sequence[Task],
    workers: int,
    on_poll: Callable[[int], None] | None = None,
) -> list[Result]:
    """The results in the order of the tasks.

    With one worker everything runs in this process. The first error stops the rest.

    Args:
        function: Defined at the top of a module, as is all that is sent to a process.
        tasks: One call each.
        workers: Processes, at least 1.
        on_poll: Told here about twice a second, and at the end, how many tasks are done.

    Raises:
        InputError: From a task, or when a worker was killed.
    """
    check_workers(workers)
    poll = on_poll or (lambda done: None)
    if workers == 1 or len(tasks) <= 1:
        results = []
        for task in tasks:
            results.append(function(task))
            poll(len(results))
        return results
    context = get_context("spawn")
    stop = context.Event()
    pool = ProcessPoolExecutor(
        min(workers, len(tasks)), context, _begin_worker, (stop, os.getpid())
    )
    try:
        futures = [pool.submit(_guarded, function, task) for task in tasks]
        _wait_for(futures, poll)
        return [_result(future) for future in futures]
    except BrokenProcessPool as error:
        raise InputError(
            "a worker process ended before its work was done",
            where="--workers",
            remedy="give fewer workers if memory ran out, then run the command again to resume",
        ) from error
    finally:
        stop.set()
        pool.shutdown(wait=False, cancel_futures=True)


def _wait_for(futures: Sequence["Future[Any]"], poll: Callable[[int], None]) -> None:
    pending = set(futures)
    while pending:
        done, pending = wait(pending, timeout=_POLL_S, return_when=FIRST_COMPLETED)
        for future in done:
            _result(future)
        poll(len(futures) - len(pending))


def _result(future: "Future[Any]") -> Any:
    result = future.result()
    if isinstance(result, _Failure):
        raise InputError(result.rule, where=result.where, remedy=result.remedy)
    return result


def _guarded(function: Callable[[Task], Result], task: Task) -> Result | _Failure:
    try:
        return function(task)
    except InputError as error:
        return _Failure(error.rule, error.where, error.remedy)


def _begin_worker(stop: Any, parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(stop, parent), daemon=True).start()


def _end_with(stop: Any, parent: int) -> None:
    """End this process when the work is over, also when the parent could not say so."""
    while not stop.wait(_POLL_S):
        if os.getppid() != parent:
            break
    os._exit(1)

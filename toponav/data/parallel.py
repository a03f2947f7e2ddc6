"""Work divided over processes that stop when they are told to, or when their parent is gone."""

import os
import signal
import threading
from collections.abc import Callable, Hashable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any, TypeVar

from toponav.core.errors import InputError
from toponav.data.dealing import Dealer

__all__ = ["Failure", "check_workers", "guarded", "run_parallel"]

Task = TypeVar("Task")
Result = TypeVar("Result")

_POLL_S = 0.5


@dataclass(frozen=True)
class Failure:
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
    *,
    on_result: Callable[[Task, Result], None] | None = None,
    affinity: Callable[[Task], Hashable] | None = None,
) -> list[Result]:
    """The results in the order of the tasks; none where they are handed over one by one.

    With one worker everything runs in this process. The first error stops the rest.

    Args:
        function: Defined at the top of a module, as is all that is sent to a process.
        tasks: One call each.
        workers: Processes, at least 1.
        on_poll: Told here about twice a second, and at the end, how many tasks are done.
        on_result: Called here with each task and its result, in the order that they finish.
        affinity: A key of a task; tasks of the same key run in one process, as `Dealer` says.

    Raises:
        InputError: From a task, or when a worker was killed.
    """
    check_workers(workers)
    poll = on_poll or (lambda done: None)
    found: dict[int, Result] = {}

    def deliver(number: int, result: Result) -> None:
        if on_result is None:
            found[number] = result
        else:
            on_result(tasks[number], result)

    dealer = Dealer(tasks, affinity)
    if workers == 1 or len(tasks) <= 1:
        for done in range(1, len(tasks) + 1):
            number = dealer.next(0)
            assert number is not None
            deliver(number, function(tasks[number]))
            poll(done)
    else:
        _run_in_processes(function, tasks, min(workers, len(tasks)), dealer, deliver, poll)
    return [found[number] for number in sorted(found)]


def _run_in_processes(
    function: Callable[[Task], Result],
    tasks: Sequence[Task],
    workers: int,
    dealer: Dealer,
    deliver: Callable[[int, Result], None],
    poll: Callable[[int], None],
) -> None:
    context = get_context("spawn")
    stop = context.Event()
    # A pool of one process each: a pool of many would not let one choose who does what.
    pools = [
        ProcessPoolExecutor(1, context, _begin_worker, (stop, os.getpid())) for _ in range(workers)
    ]
    running: dict[Future[Any], tuple[int, int]] = {}
    done = 0

    def give(worker: int) -> None:
        number = dealer.next(worker)
        if number is not None:
            running[pools[worker].submit(guarded, function, tasks[number])] = (worker, number)

    try:
        for worker in range(workers):
            give(worker)
        while running:
            ready, _ = wait(running, timeout=_POLL_S, return_when=FIRST_COMPLETED)
            for future in ready:
                worker, number = running.pop(future)
                result = _result(future)
                # The worker goes on while its result is dealt with here.
                give(worker)
                deliver(number, result)
                done += 1
            poll(done)
    except BrokenProcessPool as error:
        raise InputError(
            "a worker process ended before its work was done",
            where="--workers",
            remedy="give fewer workers if memory ran out, then run the command again to resume",
        ) from error
    finally:
        stop.set()
        for pool in pools:
            pool.shutdown(wait=False, cancel_futures=True)


def _result(future: "Future[Any]") -> Any:
    result = future.result()
    if isinstance(result, Failure):
        raise InputError(result.rule, where=result.where, remedy=result.remedy)
    return result


def guarded(function: Callable[[Task], Result], task: Task) -> Result | Failure:
    """What the function makes of a task, or why it could not; sent between processes."""
    try:
        return function(task)
    except InputError as error:
        return Failure(error.rule, error.where, error.remedy)


def _begin_worker(stop: Any, parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(stop, parent), daemon=True).start()


def _end_with(stop: Any, parent: int) -> None:
    """End this process when the work is over, also when the parent could not say so."""
    while not stop.wait(_POLL_S):
        if os.getppid() != parent:
            break
    os._exit(1)

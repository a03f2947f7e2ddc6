"""Which worker does which task: those that share what is slow to make go to one worker."""

from collections import defaultdict, deque
from collections.abc import Callable, Hashable, Sequence
from typing import Any

__all__ = ["Dealer"]


class Dealer:
    """Deals tasks to workers, one at a time, each task once.

    Tasks of one key form a group, such as the episodes of a home, and a worker that has begun a
    group goes on with it. So what a group shares is made once, not once on every worker. The
    largest groups begin first. When all have begun, a worker with nothing left to do takes half
    of what is left of the largest, from its end.

    Args:
        tasks: What to deal.
        key: A task's key; None makes each task a group, dealt in order.

    Example:
        >>> dealer = Dealer(["a1", "a2", "b1", "a3"], lambda task: task[0])
        >>> [dealer.next(worker) for worker in (0, 1, 0, 1, 0)]
        [0, 2, 1, 3, None]
    """

    def __init__(self, tasks: Sequence[Any], key: Callable[[Any], Hashable] | None = None) -> None:
        groups: dict[Hashable, list[int]] = defaultdict(list)
        for number, task in enumerate(tasks):
            groups[number if key is None else key(task)].append(number)
        self._fresh = deque(sorted(groups.values(), key=len, reverse=True))
        self._begun: dict[int, deque[int]] = {}

    def next(self, worker: int) -> int | None:
        """The number of the task that a worker does next; None when none is left.

        Args:
            worker: Any number that stands for it.
        """
        own = self._begun.get(worker)
        if not own:
            own = self._begun[worker] = self._group()
        return own.popleft() if own else None

    def _group(self) -> deque[int]:
        if self._fresh:
            return deque(self._fresh.popleft())
        most = max(self._begun.values(), key=len, default=None)
        if not most:
            return deque()
        half = (len(most) + 1) // 2
        return deque([most.pop() for _ in range(half)][::-1])

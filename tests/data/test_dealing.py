"""Which worker gets which task."""

from toponav.data.dealing import Dealer


def dealt(tasks: str, turns: list[int]) -> list[str | None]:
    dealer = Dealer(tasks, str.lower)
    numbers = [dealer.next(worker) for worker in turns]
    return [None if number is None else tasks[number] for number in numbers]


def test_without_keys_tasks_are_dealt_in_order() -> None:
    dealer = Dealer("abc")
    assert [dealer.next(worker) for worker in (1, 0, 1, 0)] == [0, 1, 2, None]


def test_one_worker_finishes_a_group_before_the_next() -> None:
    assert dealt("abAB", [0] * 5) == ["a", "A", "b", "B", None]


def test_a_group_stays_with_its_worker() -> None:
    assert dealt("abAB", [0, 1, 1, 0, 0]) == ["a", "b", "B", "A", None]


def test_the_largest_group_begins_first() -> None:
    assert dealt("abBB", [0, 1]) == ["b", "a"]


def test_a_worker_without_work_takes_half_of_what_another_has_left() -> None:
    dealer = Dealer(range(7), lambda number: 0)
    assert [dealer.next(0) for _ in range(2)] == [0, 1]
    # Left are 2 to 6: the other takes the last three, and goes on with them.
    assert [dealer.next(1) for _ in range(3)] == [4, 5, 6]
    assert [dealer.next(0), dealer.next(0), dealer.next(0)] == [2, 3, None]


def test_every_task_is_dealt_once_whoever_asks() -> None:
    dealer = Dealer(range(50), lambda number: number % 7)
    numbers = [dealer.next(step * step % 3) for step in range(50)]
    assert sorted(number for number in numbers if number is not None) == list(range(50))
    assert dealer.next(9) is None

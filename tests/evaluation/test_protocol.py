import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.evaluation.tiny_building import PLAN, tiny_map
from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.vocabulary import Behavior, Outcome
from toponav.evaluation.protocol import EpisodeJudge, JudgeRules, nominal_time_s
from toponav.maps.plan import Plan, shortest_plan

MAP = tiny_map()
PLANNED = shortest_plan(MAP, "office_1", "office_2")
START = Pose2(2.0, 1.8, math.pi / 2)
ASTRAY = "hallway_1-1l"


class Script:
    """Says whatever node is to be true next."""

    node: str | None = None

    def node_at(self, pose: Pose2) -> str | None:
        return self.node


class Run:
    """A judge with scripted nodes; the robot moves a metre a step unless told to stand."""

    def __init__(self, rules: JudgeRules | None = None) -> None:
        self.script = Script()
        self.judge = EpisodeJudge(MAP, PLANNED, self.script, START, rules)
        self.pose = START
        self.steps = 0

    def step(
        self, node: str | None, contact: str | None = None, moved_m: float = 1.0, turned: float = 0
    ) -> Outcome | None:
        self.script.node = node
        self.steps += 1
        self.pose = Pose2(self.pose.x_m + moved_m, self.pose.y_m, self.pose.yaw_rad + turned)
        return self.judge.update(self.pose, contact, 0.2 * self.steps)

    def until_goal(self, *nodes: str | None) -> "Run":
        for node in (*nodes, "office_2"):
            if not self.judge.finished:
                self.step(node)
        return self


def test_reaching_the_goal_node_succeeds_by_both_rules() -> None:
    judge = Run().until_goal(*PLAN[:-1]).judge
    assert judge.strict == judge.tolerant
    assert judge.strict.success
    assert judge.strict.plan_completion == 1.0
    assert judge.strict.step == 5
    assert judge.strict.time_s == pytest.approx(1.0)


def test_one_step_off_the_plan_fails_strictly_and_the_run_goes_on() -> None:
    run = Run()
    assert run.step("office_1_door") is None
    assert run.step(ASTRAY) is None
    judge = run.until_goal("hallway_1-1r").judge
    assert judge.strict.outcome is Outcome.DEVIATED
    assert (judge.strict.step, judge.strict.node) == (2, ASTRAY)
    assert judge.strict.plan_completion == 2 / 5
    assert judge.tolerant.success


def test_five_consecutive_steps_off_the_plan_fail_by_the_tolerant_rule() -> None:
    run = Run()
    assert [run.step(ASTRAY) for _ in range(4)] == [None] * 4
    assert run.step(ASTRAY) is Outcome.DEVIATED
    assert run.judge.tolerant.step == 5
    assert run.judge.strict.step == 1


def test_four_steps_off_the_plan_and_back_are_forgiven_again_and_again() -> None:
    nodes = [*[ASTRAY] * 4, "office_1", *[ASTRAY] * 4, "office_1_door"]
    judge = Run().until_goal(*nodes).judge
    assert judge.tolerant.success
    assert judge.strict.outcome is Outcome.DEVIATED


def test_a_step_without_a_true_node_is_no_deviation() -> None:
    judge = Run().until_goal(*[None] * 30).judge
    assert judge.strict.success


def test_a_step_without_a_true_node_does_not_interrupt_a_deviation() -> None:
    run = Run()
    for node in (ASTRAY, None, ASTRAY, None, ASTRAY, ASTRAY):
        assert run.step(node) is None
    assert run.step(ASTRAY) is Outcome.DEVIATED


def test_standing_for_fifty_steps_is_stuck() -> None:
    run = Run()
    outcomes = [run.step("office_1", moved_m=0.0) for _ in range(50)]
    assert outcomes == [None] * 49 + [Outcome.STUCK]
    assert run.judge.strict.outcome is Outcome.STUCK


@pytest.mark.parametrize(
    ("moved_m", "turned", "is_stuck"),
    [(0.0099, 0.0, True), (0.0101, 0.0, False), (0.0, 0.0069, True), (0.0, 0.0071, False)],
)
def test_half_a_metre_or_twenty_degrees_in_fifty_steps_is_motion(
    moved_m: float, turned: float, is_stuck: bool
) -> None:
    run = Run()
    outcomes = [run.step("office_1", moved_m=moved_m, turned=turned) for _ in range(50)]
    assert (outcomes[-1] is Outcome.STUCK) == is_stuck


def test_any_contact_fails() -> None:
    run = Run(JudgeRules(both_collision_rules=False))
    run.step("office_1")
    assert run.step("office_1_door", contact="chair") is Outcome.COLLIDED
    assert run.judge.strict.contact == "chair"


def test_a_run_goes_on_after_a_contact_to_be_judged_by_the_softer_rule_too() -> None:
    run = Run()
    run.step("office_1")
    assert run.step("office_1_door", contact="chair") is None
    judge = run.until_goal("hallway_1-1r").judge
    assert (judge.strict.outcome, judge.strict.step) == (Outcome.COLLIDED, 2)
    assert judge.tolerant == judge.strict
    assert judge.verdict("strict", "stuck").success
    assert judge.verdict("tolerant", "stuck").contact is None


def test_the_verdicts_do_not_depend_on_whether_the_run_goes_on() -> None:
    alone, both = Run(JudgeRules(both_collision_rules=False)), Run()
    for run in (alone, both):
        for node, contact in (("office_1", None), (ASTRAY, None), ("office_1_door", "wall")):
            run.step(node, contact=contact)
    assert alone.judge.finished
    assert not both.judge.finished
    assert (alone.judge.strict, alone.judge.tolerant) == (both.judge.strict, both.judge.tolerant)


def test_contact_at_the_goal_fails() -> None:
    run = Run()
    assert run.step("office_2", contact="door") is Outcome.SUCCESS
    assert run.judge.strict.outcome is Outcome.COLLIDED
    assert run.judge.verdict("strict", "stuck").success


def test_the_softer_rule_overlooks_contact() -> None:
    run = Run(JudgeRules(collisions="stuck"))
    assert run.step("office_1_door", contact="wall") is None
    assert run.step("office_2", contact="wall") is Outcome.SUCCESS
    assert run.judge.strict.contact is None


def test_the_softer_rule_fails_a_robot_that_contact_holds() -> None:
    run = Run(JudgeRules(collisions="stuck"))
    outcomes = [run.step("office_1", contact="wall", moved_m=0.0) for _ in range(50)]
    assert outcomes[-1] is Outcome.STUCK


def test_a_deviated_run_that_then_collides_has_both_verdicts() -> None:
    run = Run()
    run.step(ASTRAY)
    run.step(ASTRAY, contact="wall")
    assert run.judge.strict.outcome is Outcome.DEVIATED
    assert run.judge.tolerant.outcome is Outcome.COLLIDED
    assert run.judge.tolerant.failed_edge == 0


def test_three_times_the_nominal_time_is_a_timeout() -> None:
    run = Run()
    limit_s = 3 * nominal_time_s(MAP, PLANNED, START)
    assert run.judge.timeout_s == pytest.approx(limit_s)
    outcome = None
    while outcome is None:
        outcome = run.step("office_1")
    assert outcome is Outcome.TIMEOUT
    assert run.judge.tolerant.time_s == pytest.approx(math.ceil(limit_s / 0.2) * 0.2)


def test_nominal_time_is_legs_at_half_a_metre_a_second_plus_turns_at_a_radian_a_second() -> None:
    plan = Plan(("office_1", "office_1_door"), ("office_1->office_1_door",))
    door = MAP.node("office_1_door")
    facing_away = Pose2(door.x_m - 1.0, door.y_m, math.pi)
    assert nominal_time_s(MAP, plan, facing_away) == pytest.approx(1.0 / 0.5 + math.pi)


def test_completion_counts_the_start_node_and_nodes_skipped_over() -> None:
    run = Run()
    run.step("hallway_1-1r")
    for _ in range(5):
        run.step(ASTRAY)
    assert run.judge.tolerant.nodes_reached == 3
    assert run.judge.tolerant.edges_attempted == 3
    assert run.judge.tolerant.edges_passed == 2


def test_going_back_along_the_plan_keeps_what_was_reached() -> None:
    run = Run()
    for node in ("hallway_1-1r", "office_1_door", *[ASTRAY] * 5):
        run.step(node)
    assert run.judge.tolerant.nodes_reached == 3


def test_completion_goes_on_after_the_strict_verdict() -> None:
    run = Run()
    for node in (ASTRAY, "hallway_1-1r", *[ASTRAY] * 5):
        run.step(node)
    assert run.judge.strict.nodes_reached == 1
    assert run.judge.tolerant.nodes_reached == 3


def test_the_truth_names_the_edge_and_the_behaviour_that_the_plan_wants() -> None:
    run = Run()
    still = Velocity(0.0, 0.0)
    assert run.judge.truth(START, still).behavior is Behavior.FIND_DOOR
    run.step("office_1_door")
    truth = run.judge.truth(run.pose, still)
    assert (truth.node, truth.plan_index) == ("office_1_door", 1)
    assert truth.edge == "office_1_door->hallway_1-1r"
    run.step(ASTRAY)
    astray = run.judge.truth(run.pose, still)
    assert (astray.plan_index, astray.edge, astray.behavior) == (None, None, None)


@given(st.lists(st.sampled_from([*PLAN[:-1], ASTRAY, None]), min_size=1, max_size=60), st.data())
@settings(max_examples=60, deadline=None)
def test_the_strict_verdict_is_never_later_nor_kinder(
    nodes: list[str | None], data: st.DataObject
) -> None:
    run = Run()
    for node in nodes:
        moved_m = data.draw(st.sampled_from([0.0, 0.02, 1.0]))
        if run.step(node, moved_m=moved_m) is not None:
            break
    while not run.judge.finished:
        run.step(ASTRAY)
    strict, tolerant = run.judge.strict, run.judge.tolerant
    assert strict.step <= tolerant.step
    assert strict.nodes_reached <= tolerant.nodes_reached
    assert not strict.success or tolerant.success
    assert strict == tolerant or strict.outcome is Outcome.DEVIATED


@pytest.mark.parametrize("rule", [{"stuck_steps": 0}, {"timeout_factor": math.nan}])
def test_rules_have_to_be_positive(rule: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(rule))):
        JudgeRules(**rule)

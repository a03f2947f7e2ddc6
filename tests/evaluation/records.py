"""Episode records made by hand."""

from dataclasses import replace

from tests.evaluation.tiny_building import tiny_map
from toponav.core.vocabulary import Outcome
from toponav.evaluation.episode import EpisodeRecord, Step
from toponav.evaluation.protocol import Verdict
from toponav.maps.plan import shortest_plan

MAP = tiny_map()
PLAN = shortest_plan(MAP, "office_1", "office_2")

STEP = Step(
    time_s=0.0,
    x_m=1.0,
    y_m=2.0,
    yaw_rad=0.5,
    linear_m_s=0.5,
    angular_rad_s=-0.25,
    true_node="office_1",
    true_edge="office_1->office_1_door",
    true_behavior="find_door",
    believed_node="office_1",
    believed_edge="office_1->office_1_door",
    behavior="find_door",
    stopped_because="",
    plan_probability=(0.75, 0.25, 0.0, 0.0),
    elsewhere_probability=0.0,
    act_ms=2.0,
)


def verdict(outcome: Outcome, nodes_reached: int, step: int = 2) -> Verdict:
    return Verdict(outcome, nodes_reached, len(PLAN.nodes), step, 0.2 * step, PLAN.nodes[0])


def record(
    agent: str = "gtl",
    index: int = 0,
    strict: Verdict | None = None,
    tolerant: Verdict | None = None,
    steps: tuple[Step, ...] = (),
) -> EpisodeRecord:
    """A success unless told otherwise."""
    success = verdict(Outcome.SUCCESS, len(PLAN.nodes))
    strict = strict or success
    return EpisodeRecord(
        agent=agent,
        index=index,
        plan=PLAN,
        behaviors=PLAN.behaviors(MAP),
        transitions=("within office", "office->hallway", "within hallway", "hallway->office"),
        strict=strict,
        tolerant=tolerant or strict,
        timeout_s=60.0,
        wall_s=0.5,
        steps=steps or (STEP, replace(STEP, time_s=0.25, x_m=1.125)),
    )

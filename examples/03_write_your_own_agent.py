"""An agent of your own, judged by GraphNav's protocol beside the expert.

python examples/03_write_your_own_agent.py

The same from the command line, with a scene and map of yours:

PYTHONPATH=examples toponav eval graphnav --scene office --map office.topo.json
--agent 03_write_your_own_agent:make_agent --out results
"""

import tempfile
from pathlib import Path

import numpy as np

from toponav.core.episode import Belief, Observation, Velocity
from toponav.core.vocabulary import Behavior
from toponav.evaluation.agents import AgentContext
from toponav.evaluation.runner import EvaluationConfig, evaluate
from toponav.evaluation.suite import SuiteSource
from toponav.maps.construct import map_from_layout
from toponav.maps.spec import save_map
from toponav.maps.task import NavigationTask
from toponav.worlds.generate.office import generate_office
from toponav.worlds.storage import save_scene

STEP_S = 0.2
TURN_RAD_S = {Behavior.TURN_LEFT: 0.5, Behavior.TURN_RIGHT: -0.5}


class ClockworkAgent:
    """Plays the plan's behaviours by the clock: an edge of so many metres takes so long.

    It shows the three methods that an agent has. It is a poor agent: as soon as it is late,
    it does the right thing in the wrong place.
    """

    def reset(self, task: NavigationTask) -> None:
        """Begin an episode: here are the map and the plan, and you stand at its first node."""
        edges = [task.map.edge(edge) for edge in task.plan.edges]
        self._edges = edges
        self._ends_s = np.cumsum([edge.length_m / 0.4 for edge in edges])
        self._edge = edges[0]

    def act(self, observation: Observation) -> Velocity:
        """One command every 0.2 s, from the depth image and what was remembered."""
        now = int(np.searchsorted(self._ends_s, observation.time_s))
        self._edge = self._edges[min(now, len(self._edges) - 1)]
        depth_m = observation.depth_m
        middle = depth_m[depth_m.shape[0] // 2]
        half = len(middle) // 2
        centering = 0.8 * float(middle[:half].mean() - middle[half:].mean())
        ahead_m = float(middle[half - half // 4 : half + half // 4].min())
        turn = TURN_RAD_S.get(self._edge.behavior, 0.0) + centering
        return Velocity(0.4 if ahead_m > 0.5 else 0.0, turn)

    def belief(self) -> Belief:
        """What the agent thinks, for the localization metrics and for display."""
        return Belief(self._edge.source, self._edge.id, self._edge.behavior)


def make_agent(context: AgentContext) -> ClockworkAgent:
    """What `--agent 03_write_your_own_agent:make_agent` calls."""
    return ClockworkAgent()


def main(out: Path) -> None:
    scene = generate_office(7, size="small")
    save_scene(scene, out / "office")
    save_map(map_from_layout(scene), out / "office.topo.json")
    source = SuiteSource(scene=out / "office", map=out / "office.topo.json", episodes=2)
    agents = ("03_write_your_own_agent:make_agent", "expert")
    evaluation = evaluate(EvaluationConfig(source, agents, out / "results"))
    for name, numbers in evaluation.results["agents"].items():
        completion = numbers["plan_completion"]
        print(f"{name}: {completion:.0%} of the plans' nodes reached, {numbers['outcomes']}")
    print(f"everything about the runs: {evaluation.out}")


if __name__ == "__main__":
    main(Path(tempfile.mkdtemp(prefix="toponav-")))

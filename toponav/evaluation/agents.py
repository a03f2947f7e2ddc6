"""The registry of agents: what each name means, and how a command line chooses among them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Agent, VelocityLimits
from toponav.core.errors import InputError, did_you_mean
from toponav.evaluation.choice import Choice, imported_factory
from toponav.evaluation.privileged import ExpertAgent, GroundTruthLocationAgent
from toponav.maps.spec import TopologicalMap
from toponav.maps.task import NavigationTask

if TYPE_CHECKING:
    from toponav.navigation.graphnav.metric_agent import MetricGraphNavAgent
    from toponav.worlds.scene import Scene

__all__ = [
    "AGENTS",
    "FAMILIES",
    "AgentChoice",
    "AgentContext",
    "AgentSpec",
    "ExpertAgent",
    "GroundTruthLocationAgent",
    "WeightsFamily",
    "check_agent_name",
    "check_weights",
    "make_agent",
    "probes_of",
    "title_of",
]


@dataclass(frozen=True)
class AgentContext:
    """What an agent is built from; agents that are not privileged ignore the scene.

    Attributes:
        scene: The building.
        map: Its topological map.
        camera: The camera that the robot carries.
        limits: What the robot can do.
        weights: Folder or preset of the networks; None is what ships with the package.
        seed: Seed of the agent's random numbers.
        options: Settings given with the agent's name, as text (`graphnav_pf,particles=300`).
    """

    scene: "Scene"
    map: TopologicalMap
    camera: PinholeCamera = field(default_factory=PinholeCamera)
    limits: VelocityLimits = field(default_factory=VelocityLimits)
    weights: str | None = None
    seed: int = 0
    options: Mapping[str, str] = field(default_factory=dict)


Builder = Callable[[AgentContext], Agent[NavigationTask]]


@dataclass(frozen=True)
class AgentSpec:
    """One line of the registry.

    Attributes:
        title: Name in tables.
        build: Makes the agent.
        is_learned: Whether it has weights.
        is_privileged: Whether it is shown the truth.
        is_probe: Whether it only measures something while another drives; tables of success
            leave it out.
        options: Names of the settings that it takes.
    """

    title: str
    build: Builder
    is_learned: bool = True
    is_privileged: bool = False
    is_probe: bool = False
    options: frozenset[str] = frozenset()


@dataclass(frozen=True)
class AgentChoice(Choice):
    """An agent of the GraphNav suite as it is chosen for an evaluation."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_agent_name(self.agent)
        self._check_options()

    @property
    def spec(self) -> AgentSpec | None:
        """The agent's line in the registry, or None for one of the user's own."""
        return AGENTS.get(self.agent)

    def _check_options(self) -> None:
        known = self.spec.options if self.spec is not None else None
        for name, _ in self.options:
            if known is not None and name not in known:
                hint = did_you_mean(name, known) if known else "It takes none."
                raise InputError(
                    f"{self.agent} has no setting '{name}'", where="--agent", remedy=hint
                )


@dataclass(frozen=True)
class WeightsFamily:
    """What the names graphnav, graphnav_pf and gtl mean for one kind of weights.

    Attributes:
        name: Name of the kind.
        owns: Whether weights (a folder, a preset, or None for what ships) are of this kind.
        builders: How to build each agent of the registry from them.
    """

    name: str
    owns: Callable[[str | None], bool]
    builders: Mapping[str, Builder]


def _crop_graphnav(context: AgentContext) -> Agent[NavigationTask]:
    return _load_graphnav(context, particle_filter=False)


def _crop_graphnav_pf(context: AgentContext) -> Agent[NavigationTask]:
    return _load_graphnav(context, particle_filter=True)


def _load_graphnav(context: AgentContext, *, particle_filter: bool) -> Agent[NavigationTask]:
    from toponav.navigation.graphnav.agent import load_agent

    agent: Agent[NavigationTask] = load_agent(
        context.weights,
        particle_filter=particle_filter,
        camera=context.camera,
        seed=context.seed,
    )
    return agent


def _crop_gtl(context: AgentContext) -> Agent[NavigationTask]:
    from toponav.navigation.graphnav.driver import load_driver

    return GroundTruthLocationAgent(load_driver(context.weights, camera=context.camera))


def _crop_teacher_forced(context: AgentContext) -> Agent[NavigationTask]:
    from toponav.evaluation.teacher_forced import CropPredictor, TeacherForcedAgent

    return TeacherForcedAgent(_expert(context), CropPredictor(context.weights, context.camera))


CROP_FAMILY = WeightsFamily(
    "crop",
    lambda weights: True,
    {
        "graphnav": _crop_graphnav,
        "graphnav_pf": _crop_graphnav_pf,
        "gtl": _crop_gtl,
        "teacher_forced": _crop_teacher_forced,
    },
)
"""The paper's scheme: a network that names an edge in a crop of the map."""


def _is_metric(weights: str | None) -> bool:
    from toponav.models.checkpoints import holds_metric_weights

    return holds_metric_weights(weights or "best")


def _metric_graphnav(context: AgentContext) -> Agent[NavigationTask]:
    return _metric_agent(context, pose_filter=False)


def _metric_graphnav_pf(context: AgentContext) -> Agent[NavigationTask]:
    return _metric_agent(context, pose_filter=True)


def _metric_gtl(context: AgentContext) -> Agent[NavigationTask]:
    from toponav.evaluation.true_pose import TruePoseAgent

    return TruePoseAgent(_metric_agent(context, pose_filter=True))


def _metric_agent(context: AgentContext, *, pose_filter: bool) -> "MetricGraphNavAgent":
    from toponav.navigation.graphnav.metric_agent import load_metric_agent

    for name, told in context.options.items():
        if told not in ("on", "off"):
            raise InputError(
                f"{name} is on or off, got '{told}'",
                where="--agent",
                remedy=f"write for instance graphnav_pf=best,{name}=off",
            )
    return load_metric_agent(
        context.weights,
        pose_filter=pose_filter,
        camera=context.camera,
        without=[name for name, told in context.options.items() if told == "off"],
    )


_METRIC_OPTIONS = frozenset({"avoidance", "hypotheses", "plan_keeping", "detours"})


def _metric_own_belief(context: AgentContext) -> Agent[NavigationTask]:
    from toponav.evaluation.teacher_forced import OwnBeliefAgent
    from toponav.navigation.graphnav.metric_agent import load_metric_agent

    asked = load_metric_agent(context.weights, pose_filter=True, camera=context.camera)
    return OwnBeliefAgent(_expert(context), asked)


METRIC_FAMILY = WeightsFamily(
    "metric",
    _is_metric,
    {
        "graphnav": _metric_graphnav,
        "graphnav_pf": _metric_graphnav_pf,
        "gtl": _metric_gtl,
        "own_belief": _metric_own_belief,
    },
)
"""Preset `best`: a belief over poses in place of a crop of the map."""

FAMILIES: Sequence[WeightsFamily] = (METRIC_FAMILY, CROP_FAMILY)
"""Kinds of weights; the first that owns the weights builds the agents. Others go in front."""


def _by_family(name: str) -> Builder:
    def build(context: AgentContext) -> Agent[NavigationTask]:
        # What ships holds both kinds; weights that are named are of one.
        family = next(
            one
            for one in FAMILIES
            if one.owns(context.weights) and (context.weights or name in one.builders)
        )
        if name not in family.builders:
            raise InputError(
                f"there is no {name} for weights of the kind '{family.name}'",
                where="--agent",
                remedy=f"with these weights use {', '.join(sorted(family.builders))}",
            )
        return family.builders[name](context)

    return build


def _phasenet(context: AgentContext) -> Agent[NavigationTask]:
    from toponav.navigation.baselines.phasenet_agent import load_phasenet_agent

    agent: Agent[NavigationTask] = load_phasenet_agent(context.weights, camera=context.camera)
    return agent


def _behavrnn(context: AgentContext) -> Agent[NavigationTask]:
    from toponav.navigation.baselines.behavrnn_agent import load_behavrnn_agent

    agent: Agent[NavigationTask] = load_behavrnn_agent(context.weights, camera=context.camera)
    return agent


def _expert(context: AgentContext) -> ExpertAgent:
    from toponav.data.expert import Expert

    return ExpertAgent(Expert(context.scene, context.map, limits=context.limits))


AGENTS: Mapping[str, AgentSpec] = {
    "phasenet": AgentSpec("PhaseNet", _phasenet),
    "behavrnn": AgentSpec("BehavRNN", _behavrnn),
    "graphnav": AgentSpec("GraphNav", _by_family("graphnav"), options=_METRIC_OPTIONS),
    "graphnav_pf": AgentSpec("GraphNavPF", _by_family("graphnav_pf"), options=_METRIC_OPTIONS),
    "gtl": AgentSpec("GTL", _by_family("gtl"), is_privileged=True, options=_METRIC_OPTIONS),
    "expert": AgentSpec("Expert", _expert, is_learned=False, is_privileged=True),
    "teacher_forced": AgentSpec(
        "Teacher forced", _by_family("teacher_forced"), is_privileged=True, is_probe=True
    ),
    "own_belief": AgentSpec(
        "Own belief on the expert's drives",
        _by_family("own_belief"),
        is_privileged=True,
        is_probe=True,
    ),
}
"""Every agent of the GraphNav suite by name, in the order of the tables."""


def probes_of(weights: str | None) -> tuple[str, ...]:
    """Names of the agents that measure the localization of weights like these."""
    family = next(one for one in FAMILIES if one.owns(weights))
    return tuple(name for name in family.builders if AGENTS[name].is_probe)


def check_agent_name(name: str) -> None:
    """Nothing, if the name is in the registry or is an importable `module:factory`.

    Raises:
        InputError: Otherwise; offers the nearest name.
    """
    if ":" in name:
        imported_factory(name, "an AgentContext")
    elif name not in AGENTS:
        raise InputError(
            f"no agent is called '{name}'",
            where="--agent",
            remedy=f"{did_you_mean(name, AGENTS)} Or give your own as module:factory",
        )


def check_weights(weights: str | None, names: Iterable[str]) -> None:
    """Nothing, if the learned ones of these agents find their networks whole.

    Raises:
        InputError: If there are no such weights, or a file of them is broken.
    """
    names = frozenset(names)
    if names & {"phasenet", "behavrnn"}:
        from toponav.models import checkpoints

        if "phasenet" in names:
            checkpoints.load_phasenet(weights or "compact")
        if "behavrnn" in names:
            checkpoints.load_behavrnn(weights or "compact")
    if any(name in AGENTS and AGENTS[name].is_learned for name in names):
        from toponav.models.checkpoints import load_any_weights

        load_any_weights(weights or "best")


def make_agent(name: str, context: AgentContext) -> Agent[NavigationTask]:
    """The agent of that name.

    Args:
        name: A name of the registry, or `module:factory`, where the factory takes an
            `AgentContext` and returns an agent.
        context: What it is built from.

    Raises:
        InputError: If there is no such agent, or its weights cannot be read.
    """
    check_agent_name(name)
    if ":" in name:
        agent: Agent[NavigationTask] = imported_factory(name, "an AgentContext")(context)
        return agent
    return AGENTS[name].build(context)


def title_of(label: str, agent: str | None = None) -> str:
    """An agent's name for tables: the registry's title, and what tells it from others.

    Args:
        label: Its name in the results.
        agent: Its name in the registry, where known.

    Example:
        >>> title_of("graphnav_pf"), title_of("graphnav_pf=runs/best")
        ('GraphNavPF', 'GraphNavPF (runs/best)')
    """
    base, distinct = label, ""
    for separator in ("=", ","):
        head, found, tail = label.partition(separator)
        if found and len(head) < len(base):
            base, distinct = head, tail
    if base in AGENTS:
        return AGENTS[base].title + (f" ({distinct})" if distinct else "")
    known = AGENTS.get(agent or "")
    return f"{known.title} ({label})" if known is not None else label

"""The registry of image-goal agents: what each name means, and how a command line chooses."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from toponav.core.camera import PanoramaCamera
from toponav.core.errors import InputError, did_you_mean
from toponav.core.imagenav import ImageNavAgent
from toponav.evaluation.choice import Choice, imported_factory
from toponav.sim.imagenav import IMAGE_NAV_CAMERA

__all__ = [
    "IMAGE_NAV_AGENTS",
    "TABLE_AGENTS",
    "ImageNavChoice",
    "ImageNavContext",
    "ImageNavSpec",
    "make_image_nav_agent",
    "table_agents",
    "title_of",
]


@dataclass(frozen=True)
class ImageNavContext:
    """What an agent is built from; none of it is the truth.

    Attributes:
        camera: The panoramic camera.
        weights: Folder or preset of the network; None is what ships with the package.
        seed: Seed of the agent's random numbers.
        options: Settings given with the agent's name, as text.
    """

    camera: PanoramaCamera = IMAGE_NAV_CAMERA
    weights: str | None = None
    seed: int = 0
    options: Mapping[str, str] = field(default_factory=dict)


Builder = Callable[[ImageNavContext], ImageNavAgent]


@dataclass(frozen=True)
class ImageNavSpec:
    """One line of the registry.

    Attributes:
        title: Name in tables.
        build: Makes the agent.
        depth: Whether its robot has a depth camera.
        is_learned: Whether it has weights.
        is_privileged: Whether it is shown the truth.
        options: Names of the settings that it takes.
    """

    title: str
    build: Builder
    depth: bool = True
    is_learned: bool = True
    is_privileged: bool = False
    options: frozenset[str] = frozenset()


def _random(context: ImageNavContext) -> ImageNavAgent:
    from toponav.navigation.baselines.random_walk import RandomWalkAgent

    return RandomWalkAgent(context.seed)


def _shortest_path(context: ImageNavContext) -> ImageNavAgent:
    from toponav.data.nts.shortest_path import ShortestPathAgent

    return ShortestPathAgent()


def _nts(depth: bool, *, use_graph: bool = True, use_score: bool = True) -> Builder:
    def build(context: ImageNavContext) -> ImageNavAgent:
        from toponav.navigation.nts.agent import NTSAgent, NTSAgentConfig

        config = NTSAgentConfig(use_graph=use_graph, use_score=use_score)
        return NTSAgent(_network(context, depth), config, seed=context.seed)

    return build


def _frontier(context: ImageNavContext) -> ImageNavAgent:
    from toponav.navigation.baselines.frontier import FrontierAgent
    from toponav.navigation.nts.perception import Perception

    return FrontierAgent(Perception(_network(context, True)), seed=context.seed)


def _ans(depth: bool) -> Builder:
    def build(context: ImageNavContext) -> ImageNavAgent:
        from toponav.navigation.baselines.ans import ActiveNeuralSlamAgent
        from toponav.navigation.nts.perception import Perception

        return ActiveNeuralSlamAgent(Perception(_network(context, depth)), seed=context.seed)

    return build


def _oracle(*truths: Any) -> Builder:
    def build(context: ImageNavContext) -> ImageNavAgent:
        from toponav.evaluation.imagenav.oracle import FUNCTIONS, OracleAgent

        network = _network(context, True)
        return OracleAgent(network, truths or FUNCTIONS, seed=context.seed)

    return build


def _policy(name: str) -> Builder:
    def build(context: ImageNavContext) -> ImageNavAgent:
        from toponav.models.baselines.image_goal_weights import load_image_goal
        from toponav.navigation.baselines.image_goal_agent import ImageGoalAgent

        sampled = context.options.get("sampled", "on")
        if sampled not in ("on", "off"):
            raise InputError(
                f"sampled is on or off, got '{sampled}'",
                where="--agent",
                remedy=f"write for instance {name},sampled=off",
            )
        network = load_image_goal(name, context.weights)
        return ImageGoalAgent(network, context.seed, sampled=sampled == "on")

    return build


def _learned(name: str, title: str) -> ImageNavSpec:
    options = frozenset({"sampled"})
    return ImageNavSpec(title, _policy(name), depth=name.endswith("_rgbd"), options=options)


def _network(context: ImageNavContext, depth: bool) -> Any:
    return _loaded(context.weights or "nts", depth)


@lru_cache(maxsize=4)
def _loaded(weights: str, depth: bool) -> Any:
    from toponav.models.checkpoints import load_nts

    return load_nts(weights, depth=depth)


def _partial(function: str) -> ImageNavSpec:
    title = f"NTS, true {function.replace('_', ' ')}"
    return ImageNavSpec(title, _oracle(function), is_privileged=True)


IMAGE_NAV_AGENTS: dict[str, ImageNavSpec] = {
    "nts_rgb": ImageNavSpec("Neural Topological SLAM", _nts(False), depth=False),
    "nts_rgbd": ImageNavSpec("Neural Topological SLAM", _nts(True)),
    "nts_no_graph_rgbd": ImageNavSpec("NTS without graph", _nts(True, use_graph=False)),
    "nts_no_score_rgbd": ImageNavSpec("NTS without score", _nts(True, use_score=False)),
    "ans_rgb": ImageNavSpec("Active Neural SLAM, adapted", _ans(False), depth=False),
    "ans_rgbd": ImageNavSpec("Active Neural SLAM, adapted", _ans(True)),
    "frontier_rgbd": ImageNavSpec("Metric map + frontiers", _frontier),
    "il_rgb": _learned("il_rgb", "ResNet + GRU + IL"),
    "il_rgbd": _learned("il_rgbd", "ResNet + GRU + IL"),
    "target_rl_rgb": _learned("target_rl_rgb", "Target-driven RL"),
    "target_rl_rgbd": _learned("target_rl_rgbd", "Target-driven RL"),
    "metric_map_rl_rgbd": _learned("metric_map_rl_rgbd", "Metric map + RL"),
    "random": ImageNavSpec("Random walk", _random, depth=False, is_learned=False),
    "oracle": ImageNavSpec("NTS, all four functions true", _oracle(), is_privileged=True),
    "oracle_localization": _partial("localization"),
    "oracle_relative_pose": _partial("relative_pose"),
    "oracle_explorable": _partial("explorable"),
    "oracle_score": _partial("score"),
    "shortest_path": ImageNavSpec(
        "Shortest path (floor plan)", _shortest_path, is_learned=False, is_privileged=True
    ),
}
"""Every agent that has a name."""

TABLE_AGENTS = (
    *("il_rgb", "target_rl_rgb", "ans_rgb", "nts_rgb"),
    *("il_rgbd", "target_rl_rgbd", "metric_map_rl_rgbd", "frontier_rgbd", "ans_rgbd", "nts_rgbd"),
    "random",
)
"""The rows of tables 1 and 2, and what chance comes to: what `--agent all` stands for."""


def table_agents() -> tuple[str, ...]:
    """Those of `TABLE_AGENTS` whose weights ship."""
    from toponav.models.baselines.image_goal_weights import ships

    learned = {name for name in TABLE_AGENTS if "sampled" in IMAGE_NAV_AGENTS[name].options}
    return tuple(name for name in TABLE_AGENTS if name not in learned or ships(name))


@dataclass(frozen=True)
class ImageNavChoice(Choice):
    """An image-goal agent as it is chosen for an evaluation."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if ":" not in self.agent and self.agent not in IMAGE_NAV_AGENTS:
            raise InputError(
                f"no image-goal agent is called '{self.agent}'",
                where="--agent",
                remedy=f"{did_you_mean(self.agent, IMAGE_NAV_AGENTS)} Or give module:factory.",
            )

    @property
    def spec(self) -> ImageNavSpec | None:
        """The agent's line in the registry, or None for one of the user's own."""
        return IMAGE_NAV_AGENTS.get(self.agent)

    @property
    def depth(self) -> bool:
        """Whether its robot has a depth camera."""
        return self.spec is None or self.spec.depth

    @property
    def is_learned(self) -> bool:
        """Whether it has weights."""
        return self.spec is None or self.spec.is_learned


def make_image_nav_agent(name: str, context: ImageNavContext) -> ImageNavAgent:
    """The agent of a name in the registry, or what `module:factory` makes of the context.

    Raises:
        InputError: If there is no such agent, its weights cannot be read, or it is no agent.
    """
    spec = IMAGE_NAV_AGENTS.get(name)
    if spec is not None:
        for option in context.options.keys() - spec.options:
            hint = did_you_mean(option, spec.options) if spec.options else "It takes none."
            raise InputError(f"{name} has no setting '{option}'", where="--agent", remedy=hint)
        return spec.build(context)
    agent = imported_factory(name, "an ImageNavContext")(context)
    if not isinstance(agent, ImageNavAgent):
        raise InputError(
            "an agent has the methods reset, act and belief",
            where=f"--agent {name}",
            remedy="return an object that follows toponav.core.imagenav.ImageNavAgent",
        )
    return agent


def title_of(label: str, agent: str | None = None) -> str:
    """An agent's name in tables."""
    spec = IMAGE_NAV_AGENTS.get(agent or label)
    if spec is None:
        return label
    return spec.title if agent in (None, label) else f"{spec.title} ({label})"

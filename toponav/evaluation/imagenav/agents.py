"""The registry of image-goal agents: what each name means, and how a command line chooses."""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from toponav.core.camera import PanoramaCamera
from toponav.core.errors import InputError, did_you_mean
from toponav.core.imagenav import ImageNavAgent
from toponav.sim.imagenav import IMAGE_NAV_CAMERA

__all__ = [
    "IMAGE_NAV_AGENTS",
    "ImageNavChoice",
    "ImageNavContext",
    "ImageNavSpec",
    "make_image_nav_agent",
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
    """

    title: str
    build: Builder
    depth: bool = True
    is_learned: bool = True
    is_privileged: bool = False


def _random(context: ImageNavContext) -> ImageNavAgent:
    from toponav.navigation.baselines.random_walk import RandomWalkAgent

    return RandomWalkAgent(context.seed)


def _shortest_path(context: ImageNavContext) -> ImageNavAgent:
    from toponav.evaluation.imagenav.shortest_path import ShortestPathAgent

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


@dataclass(frozen=True)
class ImageNavChoice:
    """An agent as it is chosen for an evaluation: name, weights, settings, and a label.

    Attributes:
        agent: Name in the registry, or `module:factory`.
        weights: Its own folder or preset of weights; None is what the evaluation says.
        options: Settings of the agent, as names and values.
        label: Name in the results.
    """

    agent: str
    weights: str | None = None
    options: tuple[tuple[str, str], ...] = ()
    label: str = ""

    def __post_init__(self) -> None:
        if not self.label:
            weights = f"={self.weights}" if self.weights else ""
            options = "".join(f",{name}={value}" for name, value in self.options)
            object.__setattr__(self, "label", f"{self.agent}{weights}{options}")
        if not self.label.isprintable() or len(self.label) > 120:
            raise InputError(
                f"a label is up to 120 printable characters, got {self.label[:40]!r}",
                where="--agent",
                remedy="give a shorter one with ,label=NAME",
            )
        if ":" not in self.agent and self.agent not in IMAGE_NAV_AGENTS:
            raise InputError(
                f"no image-goal agent is called '{self.agent}'",
                where="--agent",
                remedy=f"{did_you_mean(self.agent, IMAGE_NAV_AGENTS)} Or give module:factory.",
            )

    @staticmethod
    def parse(text: str) -> "ImageNavChoice":
        """What `NAME`, `NAME=WEIGHTS` or `NAME=WEIGHTS,setting=value,label=LABEL` says.

        Example:
            >>> choice = ImageNavChoice.parse("random,label=chance")
            >>> choice.agent, choice.label
            ('random', 'chance')
        """
        first, *rest = text.split(",")
        name, _, weights = first.partition("=")
        options: dict[str, str] = {}
        for part in rest:
            key, equals, value = part.partition("=")
            if not equals or not key or not value or key in options:
                raise InputError(
                    f"'{part}' is no setting of its own",
                    where=f"--agent {text}",
                    remedy="write NAME=WEIGHTS,setting=value,label=LABEL; all but NAME may be "
                    "left out",
                )
            options[key] = value
        label = options.pop("label", "")
        return ImageNavChoice(name, weights or None, tuple(options.items()), label)

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
        if context.options:
            raise InputError(
                f"{name} has no setting '{next(iter(context.options))}'",
                where="--agent",
                remedy="It takes none.",
            )
        return spec.build(context)
    agent = _own(name)(context)
    if not isinstance(agent, ImageNavAgent):
        raise InputError(
            "an agent has the methods reset, act and belief",
            where=f"--agent {name}",
            remedy="return an object that follows toponav.core.imagenav.ImageNavAgent",
        )
    return agent


def _own(name: str) -> Callable[[ImageNavContext], Any]:
    module, _, factory = name.partition(":")
    try:
        made: Callable[[ImageNavContext], Any] = getattr(importlib.import_module(module), factory)
    except (ImportError, AttributeError, ValueError) as error:
        raise InputError(
            f"cannot be imported ({error})",
            where=f"--agent {name}",
            remedy="give module:factory, a function of an ImageNavContext",
        ) from None
    return made


def title_of(label: str, agent: str | None = None) -> str:
    """An agent's name in tables."""
    spec = IMAGE_NAV_AGENTS.get(agent or label)
    if spec is None:
        return label
    return spec.title if agent in (None, label) else f"{spec.title} ({label})"

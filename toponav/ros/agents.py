"""Agents by name, for robots: none of them is shown the truth."""

import importlib
from collections.abc import Callable, Mapping
from typing import Any

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Agent
from toponav.core.errors import InputError, did_you_mean
from toponav.core.imagenav import ImageNavAgent
from toponav.maps.task import NavigationTask

__all__ = ["IMAGE_AGENTS", "PLAN_AGENTS", "load_image_agent", "load_plan_agent"]

PlanAgentLoader = Callable[[str | None, PinholeCamera], Agent[NavigationTask]]
ImageAgentLoader = Callable[[str | None], ImageNavAgent]


def _graphnav(weights: str | None, camera: PinholeCamera) -> Agent[NavigationTask]:
    return _load_graphnav(weights, camera, filtered=False)


def _graphnav_pf(weights: str | None, camera: PinholeCamera) -> Agent[NavigationTask]:
    return _load_graphnav(weights, camera, filtered=True)


def _load_graphnav(
    weights: str | None, camera: PinholeCamera, *, filtered: bool
) -> Agent[NavigationTask]:
    from toponav.models.checkpoints import holds_metric_weights

    if holds_metric_weights(weights or "best"):
        from toponav.navigation.graphnav.metric_agent import load_metric_agent

        return load_metric_agent(weights, pose_filter=filtered, camera=camera)
    from toponav.navigation.graphnav.agent import load_agent

    return load_agent(weights, particle_filter=filtered, camera=camera)


def _phasenet(weights: str | None, camera: PinholeCamera) -> Agent[NavigationTask]:
    from toponav.navigation.baselines.phasenet_agent import load_phasenet_agent

    agent: Agent[NavigationTask] = load_phasenet_agent(weights, camera=camera)
    return agent


def _behavrnn(weights: str | None, camera: PinholeCamera) -> Agent[NavigationTask]:
    from toponav.navigation.baselines.behavrnn_agent import load_behavrnn_agent

    agent: Agent[NavigationTask] = load_behavrnn_agent(weights, camera=camera)
    return agent


PLAN_AGENTS: Mapping[str, PlanAgentLoader] = {
    "graphnav": _graphnav,
    "graphnav_pf": _graphnav_pf,
    "phasenet": _phasenet,
    "behavrnn": _behavrnn,
}
"""Agents that follow plans."""

IMAGE_AGENTS: Mapping[str, bool] = {"nts_rgb": False, "nts_rgbd": True}
"""Agents that look for the place of a picture, and whether they see depth."""


def load_plan_agent(
    name: str, weights: str | None, camera: PinholeCamera
) -> Agent[NavigationTask]:
    """The agent of that name, or of `module:factory`, called with weights and camera.

    Raises:
        InputError: There is none, or its weights cannot be read.
    """
    if ":" in name:
        made: Agent[NavigationTask] = imported(name)(weights, camera)
        return made
    if name not in PLAN_AGENTS:
        raise InputError(
            f"no agent that follows plans is called '{name}'",
            where="--agent",
            remedy=did_you_mean(name, PLAN_AGENTS),
        )
    return PLAN_AGENTS[name](weights, camera)


def load_image_agent(name: str, weights: str | None) -> ImageNavAgent:
    """The agent of that name, or of `module:factory`, called with the weights.

    Raises:
        InputError: There is none, or its weights cannot be read.
    """
    if ":" in name:
        made: ImageNavAgent = imported(name)(weights)
        return made
    if name not in IMAGE_AGENTS:
        raise InputError(
            f"no agent that looks for pictures is called '{name}'",
            where="--image-agent",
            remedy=did_you_mean(name, IMAGE_AGENTS),
        )
    from toponav.navigation.nts.agent import NTSAgent

    return NTSAgent.from_weights(weights or "nts", depth=IMAGE_AGENTS[name])


def imported(name: str) -> Callable[..., Any]:
    """The function that `module:function` names.

    Raises:
        InputError: There is none.
    """
    module_name, _, attribute = name.partition(":")
    try:
        found = getattr(importlib.import_module(module_name), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise InputError(
            f"'{name}' cannot be imported: {error}",
            where="toponav ros agent",
            remedy="give module:function of an installed module",
        ) from None
    if not callable(found):
        raise InputError(f"'{name}' is no function", where="toponav ros agent", remedy="name one")
    function: Callable[..., Any] = found
    return function

"""`toponav demo imagenav`: one search for the place in a picture, as a film and a page."""

import json as json_module
from pathlib import Path
from typing import Annotated, Literal

import tyro

__all__ = ["demo_imagenav"]


def demo_imagenav(
    *,
    out: Path = Path("toponav-demo-imagenav"),
    agent: str = "nts_rgbd",
    suite: str = "homes-test",
    level: Literal["easy", "medium", "hard"] = "medium",
    number: int = 0,
    sliding: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
    seed: int = 0,
    weights: str | None = None,
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Look for the place in a picture in an unseen home, and write a film and a page of it.

    toponav demo imagenav

    toponav demo imagenav --agent nts_no_score_rgbd --level hard --number 7 --out hard-7

    Args:
        out: Folder for the page and the film.
        agent: Who searches, as in `toponav eval imagenav`.
        suite: Homes.
        level: Difficulty of the episode.
        number: Its number among those of the suite and level.
        sliding: The robot slides along what it touches.
        seed: Seed of the noise and of the agent.
        weights: Folder of other weights. What ships, if left out.
        json: Print what happened as JSON.
    """
    from toponav.core.errors import InputError
    from toponav.evaluation.imagenav.agents import ImageNavChoice
    from toponav.evaluation.imagenav.episode_sets import load_episode_set
    from toponav.evaluation.imagenav.page import film_episode
    from toponav.evaluation.imagenav.worker import ImageNavSettings, ImageNavWorker

    if number < 0:
        raise InputError(
            f"episodes are numbered from 0, got {number}",
            where="--number",
            remedy="give 0 or more",
        )
    choice = ImageNavChoice.parse(agent)
    settings = ImageNavSettings(sliding=sliding, weights=weights, seed=seed)
    worker = ImageNavWorker(settings, [choice])
    worker.prepare(choice.label)
    episode = load_episode_set(suite, [level], number + 1)[number]
    made = film_episode(worker, choice.label, episode, out)
    goal = made.record.goals[0]
    if json:
        numbers = {"episode": episode.id, "outcome": goal.outcome, "spl": goal.spl}
        print(json_module.dumps({**numbers, "steps": goal.steps, "page": str(made.page)}))
        return 0
    words = {
        "success": "found it",
        "wrong_stop": "stopped elsewhere",
        "timeout": "ran out of time",
    }
    print(
        f"{episode.id}: {words[goal.outcome]} after {goal.steps} actions and {goal.path_m:.1f} m "
        f"(shortest {goal.geodesic_m:.1f} m). Open this page in a browser:\n"
        f"  {made.page.resolve().as_uri()}"
    )
    return 0

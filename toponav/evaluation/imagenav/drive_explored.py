"""The first paper's robot drives on the map that the second paper's has made."""

from collections.abc import Callable, Sequence

from toponav.core.errors import InputError
from toponav.evaluation.episode import EpisodeRecord
from toponav.evaluation.imagenav.explore import Explored
from toponav.evaluation.imagenav.explored_map import with_rooms_of
from toponav.evaluation.suite import suite_of
from toponav.evaluation.worker import EpisodeWorker, RunSettings
from toponav.worlds.scene import Scene

__all__ = ["drive_explored"]


def drive_explored(
    scene: Scene,
    found: Explored,
    plans: int,
    *,
    agents: Sequence[str] = ("graphnav_pf", "expert"),
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> list[EpisodeRecord]:
    """The records of agents that follow plans of an explored map in the building that it is of.

    The protocol is GraphNav's. Its rooms are those that the map names.

    Args:
        scene: The building that was explored.
        found: What was found in it.
        plans: How many plans, between rooms drawn by the seed.
        agents: Who drives.
        seed: Seed of the plans and of the agents.
        progress: Told how many episodes are done, and of how many.

    Raises:
        InputError: Where the map has no rooms.
    """
    if found.why_no_rooms:
        raise InputError(
            f"the map that was made has no rooms to drive between: {found.why_no_rooms}",
            where=f"exploring {scene.name}",
            remedy="let it take more steps",
        )
    chosen = suite_of(with_rooms_of(scene, found.floor), found.map, plans, seed)
    worker = EpisodeWorker(chosen, RunSettings(seed=seed))
    jobs = [(agent, task.index) for agent in agents for task in chosen.tasks]
    records = []
    for done, (agent, index) in enumerate(jobs):
        if progress is not None:
            progress(done, len(jobs))
        records.append(worker.run(agent, index))
    return records

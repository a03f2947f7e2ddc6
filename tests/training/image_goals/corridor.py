"""A corridor in which one can only go ahead or turn back."""

from functools import lru_cache

import numpy as np

from toponav.models.baselines.image_goal_presets import ImageGoalConfig
from toponav.training.image_goals.homes import HomeShelf, camera_of
from toponav.worlds.grid import GridFrame
from toponav.worlds.scene import Scene, scene_from_heights


def corridor() -> Scene:
    """1 m wide and 8 m long, with a door frame in the middle and a low box at one end."""
    heights = np.pad(np.zeros((20, 160)), 4, constant_values=2.5)
    heights[4:8, 80:84] = 2.5
    heights[20:24, 80:84] = 2.5
    heights[4:12, 150:164] = 0.5
    return scene_from_heights("corridor", GridFrame(0.05, (0.0, 0.0), *heights.shape), heights)


@lru_cache
def shelf(config: ImageGoalConfig, max_steps: int = 40) -> HomeShelf:
    """The corridor, where training wants homes."""
    return HomeShelf(
        camera=camera_of(config), max_steps=max_steps, noise=False, scenes=(corridor(),)
    )

"""Drive a robot through an office with a rule of thumb: head for where it is open.

python examples/01_drive_in_gymnasium.py
"""

import gymnasium
import numpy as np
from scipy.ndimage import minimum_filter1d

import toponav.sim
from toponav.core.camera import PinholeCamera
from toponav.worlds.generate.office import generate_office

CAMERA = PinholeCamera(width=160, height=120)


def main(steps: int = 150) -> None:
    toponav.sim.register()
    # What is not given is the paper's: a TurtleBot 2, 150 degrees of view, depths to 3.5 m.
    env = gymnasium.make(
        "toponav/BehavioralNav-v0",
        scene=generate_office(7, size="small"),
        camera=CAMERA,
        collisions="stuck",  # a contact blocks the robot instead of ending the episode
    )
    observation, info = env.reset(seed=6)
    start = info["pose"]
    driven_m = 0.0
    for _ in range(steps):
        before = info["pose"]
        observation, _, terminated, truncated, info = env.step(head_for_space(observation))
        driven_m += before.distance_to(info["pose"])
        if terminated or truncated:
            break
    end = info["pose"]
    print(f"from ({start.x_m:.1f}, {start.y_m:.1f}) to ({end.x_m:.1f}, {end.y_m:.1f})")
    print(f"{driven_m:.1f} m in {info['time_s']:.0f} s of simulated time")
    env.close()


def head_for_space(observation: dict[str, np.ndarray]) -> np.ndarray:
    """Turn to where most space is, preferring straight on, and slow down before walls."""
    depth_m = observation["depth"]  # [row, column], column 0 on the left
    middle = depth_m[depth_m.shape[0] // 2]
    columns = np.arange(len(middle)) + 0.5 - len(middle) / 2
    left_rad = np.arctan(-columns / CAMERA.focal_px)  # counter-clockwise is positive
    space_m = minimum_filter1d(middle / np.cos(left_rad), len(middle) // 6)
    best = np.argmax(np.minimum(space_m, 3.5) - 0.8 * np.abs(left_rad))
    ahead_m = space_m[len(middle) // 2]
    forward_m_s = np.clip(0.5 * (ahead_m - 0.5), 0.0, 0.5)
    if forward_m_s < 0.05:
        return np.array([0.0, 1.0], np.float32)  # always the same way, or it would dither
    return np.array([forward_m_s, np.clip(1.5 * left_rad[best], -1.0, 1.0)], np.float32)


if __name__ == "__main__":
    main()

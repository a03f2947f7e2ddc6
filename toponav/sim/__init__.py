"""What a robot senses and does: cameras, physics, and the Gymnasium environment."""

from toponav.sim.registration import register

__all__ = ["register"]

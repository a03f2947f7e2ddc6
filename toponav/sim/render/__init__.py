"""Depth cameras: one contract, four backends, and a slow reference to test the fast ones."""

from toponav.sim.render.base import DepthRenderer
from toponav.sim.render.make import Backend, check_backend, make_renderer

__all__ = ["Backend", "DepthRenderer", "check_backend", "make_renderer"]

"""Cameras: one contract, four backends, and a slow reference to test the fast ones."""

from toponav.sim.render.base import DepthRenderer
from toponav.sim.render.images import MODALITIES, Modality, RenderedImages, check_modalities
from toponav.sim.render.make import Backend, check_backend, make_renderer

__all__ = [
    "MODALITIES",
    "Backend",
    "DepthRenderer",
    "Modality",
    "RenderedImages",
    "check_backend",
    "check_modalities",
    "make_renderer",
]

"""Depth cameras by ray casting."""

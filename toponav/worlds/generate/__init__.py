"""Procedural buildings, each a pure function of its seed."""

"""Agents: observation in, action out."""

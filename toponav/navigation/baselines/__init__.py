"""Agents of the baselines that GraphNav is compared with."""

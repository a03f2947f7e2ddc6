"""Shared language of toponav: vocabulary, geometry, cameras, episodes, errors, and files."""

"""Shared language of toponav: vocabulary, geometry, cameras, episodes. No I/O."""

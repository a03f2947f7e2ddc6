"""Experts, recordings, annotation and storage."""

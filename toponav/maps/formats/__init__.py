"""Readers and writers of other map formats."""

"""Suites, protocols, metrics, tables and reports."""

"""Visual robot navigation with topological maps."""

__all__ = ["__version__"]

__version__ = "0.1.0"

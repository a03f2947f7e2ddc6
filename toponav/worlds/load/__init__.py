"""Buildings from files that users already have."""

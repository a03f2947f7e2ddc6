"""The networks of GraphNav."""

"""GraphNav's agents."""

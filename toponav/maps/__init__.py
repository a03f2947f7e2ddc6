"""What is drawn: topological maps, their checks, plans and formats."""

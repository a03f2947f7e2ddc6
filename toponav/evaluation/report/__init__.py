"""The page that the demo ends with: plan, belief, film and outcomes in one HTML file."""

"""Training of the baselines that act towards a picture end to end."""

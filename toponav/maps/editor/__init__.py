"""A map in the browser: the server of `toponav map edit`, for this machine and launch only."""

"""Makes the environments known to Gymnasium."""

__all__ = ["BEHAVIORAL_NAV_ID", "register"]

BEHAVIORAL_NAV_ID = "toponav/BehavioralNav-v0"


def register() -> None:
    """Registers the environments, once.

    Importing `toponav.sim.env` does the same, so that Gymnasium finds them by
    `gymnasium.make("toponav.sim.env:toponav/BehavioralNav-v0")` (since 1.0 it no longer looks
    for entry points).

    Example:
        >>> register()
        >>> env = gymnasium.make("toponav/BehavioralNav-v0")
    """
    from gymnasium.envs import registration

    if BEHAVIORAL_NAV_ID not in registration.registry:
        registration.register(id=BEHAVIORAL_NAV_ID, entry_point="toponav.sim.env:BehavioralNavEnv")

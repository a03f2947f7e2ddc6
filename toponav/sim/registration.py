"""Makes the environments known to Gymnasium."""

__all__ = ["BEHAVIORAL_NAV_ID", "register"]

BEHAVIORAL_NAV_ID = "toponav/BehavioralNav-v0"


def register() -> None:
    """Registers the environments, once; installing the package does this by entry point.

    Example:
        >>> register()
        >>> env = gymnasium.make("toponav/BehavioralNav-v0")
    """
    from gymnasium.envs import registration

    if BEHAVIORAL_NAV_ID not in registration.registry:
        registration.register(id=BEHAVIORAL_NAV_ID, entry_point="toponav.sim.env:BehavioralNavEnv")

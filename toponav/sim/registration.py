"""Makes the environments known to Gymnasium."""

__all__ = ["BEHAVIORAL_NAV_ID", "IMAGE_NAV_ID", "register"]

BEHAVIORAL_NAV_ID = "toponav/BehavioralNav-v0"
IMAGE_NAV_ID = "toponav/ImageNav-v0"

_ENTRY_POINTS = {
    BEHAVIORAL_NAV_ID: "toponav.sim.env:BehavioralNavEnv",
    IMAGE_NAV_ID: "toponav.sim.imagenav_env:ImageNavEnv",
}


def register() -> None:
    """Registers the environments, once.

    Importing `toponav.sim.env` or `toponav.sim.imagenav_env` does the same, so that Gymnasium
    finds them by `gymnasium.make("toponav.sim.env:toponav/BehavioralNav-v0")` (since 1.0 it no
    longer looks for entry points).

    Example:
        >>> register()
        >>> env = gymnasium.make("toponav/BehavioralNav-v0")
    """
    from gymnasium.envs import registration

    for name, entry_point in _ENTRY_POINTS.items():
        if name not in registration.registry:
            registration.register(id=name, entry_point=entry_point)

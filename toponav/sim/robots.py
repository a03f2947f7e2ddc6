"""Robots that drive: sizes, masses and what their wheels can do."""

from dataclasses import dataclass

from toponav.core.errors import InputError

__all__ = ["TURTLEBOT2", "DifferentialRobot"]


@dataclass(frozen=True)
class DifferentialRobot:
    """A round robot on two driven wheels and two casters; the defaults are a TurtleBot 2.

    Reference:
        Kobuki user guide: diameter 351.5 mm, wheel separation 230 mm, wheel diameter 70 mm;
        TurtleBot 2 specification: height 420 mm, mass 6.3 kg.
    """

    radius_m: float = 0.177
    """Radius of the body."""
    height_m: float = 0.42
    """Height of the body's top."""
    clearance_m: float = 0.015
    """Height of the body's underside above the floor."""
    mass_kg: float = 6.3
    """Mass of everything."""
    wheel_separation_m: float = 0.23
    """Distance between the two wheels' contact points."""
    wheel_radius_m: float = 0.035
    """Radius of a wheel."""
    wheel_width_m: float = 0.021
    """Width of a wheel."""
    wheel_mass_kg: float = 0.1
    """Mass of one wheel."""
    caster_offset_m: float = 0.13
    """Distance of the front and rear casters from the axle."""
    caster_radius_m: float = 0.017
    """Radius of a caster."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0.0 < value < 1000.0:
                raise InputError(
                    f"{name} must be positive, got {value}",
                    where="DifferentialRobot",
                    remedy="give metres and kilograms",
                )
        if self.wheel_separation_m / 2 >= self.radius_m:
            raise InputError(
                f"wheels must be under the body, got a separation of {self.wheel_separation_m} m",
                where="DifferentialRobot",
                remedy=f"keep it below {2 * self.radius_m:.3f} m",
            )


TURTLEBOT2 = DifferentialRobot()
"""The robot of the GraphNav paper."""

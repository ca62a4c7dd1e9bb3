"""Motorcycles ahead of the ego: Euro NCAP's CMRs and CMRb."""

from dataclasses import replace

from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.rear import approach_standing, follow_braking
from lgmd_gym.envs.families.registry import family
from lgmd_gym.envs.families.road_users import MOTORCYCLE
from lgmd_gym.envs.families.scenario import Scenario


@family("CMRs")
def approach_standing_motorcycle(
    ego_speed: float = 50 * KMH, impact_location: float = 0.5, shade: int | None = None
) -> Scenario:
    """The ego approaches a stationary motorcycle from behind (Car-to-Motorcyclist Rear stationary).

    Source: Euro NCAP Frontal Collisions v1.1.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        impact_location: Position of the motorcycle's centre across the ego's width, 0 the right side and 1
            the left, in [-0.25, 1.25].
        shade: Grey level of the rider's clothes in [0, 255]; None to draw it from the seed.
    """
    made = approach_standing(ego_speed, impact_location=impact_location, shade=shade)
    return _with_motorcycle("CMRs", made)


@family("CMRb")
def follow_braking_motorcycle(
    ego_speed: float = 50 * KMH,
    gap: float | None = None,
    headway: float | None = None,
    deceleration: float = 4.0,
    build_up: float = 1.0,
    impact_location: float = 0.5,
    shade: int | None = None,
) -> Scenario:
    """The ego follows a motorcycle that brakes to a standstill (Car-to-Motorcyclist Rear braking).

    Source: Euro NCAP Frontal Collisions v1.1, with a headway of 1.0 s and 4 m/s² within 1.0 s.

    Args:
        ego_speed: Initial speed of both, in (0, 40] [m/s].
        gap: Initial distance, in [1, 200] [m]; 40 m without `gap` and `headway`.
        headway: Alternative to `gap`: initial time headway, in [0.3, 10] [s].
        deceleration: Full deceleration of the motorcycle, in [0.5, 10] [m/s²].
        build_up: Time from the onset to the full deceleration, in [0, 5] [s].
        impact_location: As in CMRs.
        shade: Grey level of the rider's clothes in [0, 255]; None to draw it from the seed.
    """
    made = follow_braking(
        ego_speed, gap, headway, deceleration, build_up, impact_location=impact_location, shade=shade
    )
    return _with_motorcycle("CMRb", made)


def _with_motorcycle(name: str, made: Scenario) -> Scenario:
    """Return a rear scenario with a motorcycle in place of the car; the distance to its rear is the same."""
    target = replace(made.actors[0], **MOTORCYCLE.fields)
    return replace(made, family=name, actors=(target,))

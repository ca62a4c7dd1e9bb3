"""Actions by name: what has an effect on the motion of the entities, what has none, and errors for others."""

from collections.abc import Callable

from lgmd_gym.openscenario.entities import Mover
from lgmd_gym.openscenario.nodes import Element, LocatedError
from lgmd_gym.openscenario.path_actions import (
    acquire_position,
    assign_controller,
    assign_route,
    follow_trajectory,
    teleport,
)
from lgmd_gym.openscenario.speed_actions import (
    longitudinal_distance,
    speed,
    speed_profile,
    synchronize,
)
from lgmd_gym.openscenario.world import World

AT_START = 0.2  # [s] within which an entity may be deleted
Run = Callable[[float], float]
"""Carries out an action at a time [s] and returns the time of its end."""
_PRIVATE: dict[str, dict[str, Callable[[Element, Mover, World, float], float]]] = {
    "LongitudinalAction": {
        "SpeedAction": speed,
        "SpeedProfileAction": speed_profile,
        "LongitudinalDistanceAction": longitudinal_distance,
    },
    "RoutingAction": {
        "FollowTrajectoryAction": follow_trajectory,
        "AssignRouteAction": assign_route,
        "AcquirePositionAction": acquire_position,
    },
}
_DIRECT = {
    "TeleportAction": teleport,
    "SynchronizeAction": synchronize,
    "ControllerAction": assign_controller,
}
NO_EFFECT = ("AppearanceAction", "ActivateControllerAction", "VariableAction")
"""Known actions that have no effect on the motion."""


def private_action(item: Element, mover: Mover, world: World) -> Run | None:
    """Return the function of a `PrivateAction`, or None for an action without effect.

    Raises:
        ValueError: If the action is not supported.
    """
    found = item.only(*_PRIVATE, *_DIRECT, *NO_EFFECT)
    if found.tag in NO_EFFECT:
        found.skip()
        return None
    function = _DIRECT.get(found.tag)
    if function is None:
        found = found.only(*_PRIVATE[found.tag])
        function = {name: value for group in _PRIVATE.values() for name, value in group.items()}[found.tag]

    def run(time: float) -> float:
        try:
            return function(found, mover, world, time)
        except LocatedError:
            raise
        except ValueError as error:
            raise found.error(f"{found.tag}: {error}") from None

    return run


def global_action(item: Element, world: World) -> Run | None:
    """Return the function of a `GlobalAction` in a story, or None for an action without effect."""
    found = item.only("EntityAction", *NO_EFFECT)
    if found.tag in NO_EFFECT:
        found.skip()
        return None
    mover = world.mover(found)
    found.only("DeleteEntityAction")

    def run(time: float) -> float:
        if time > AT_START:
            raise found.error(
                f"DeleteEntityAction at {time:.3g} s is supported in the first {AT_START:g} s only"
            )
        mover.deleted = True
        return time

    return run

"""The register of scenario families, and what they share. The families are in the modules beside."""

from collections.abc import Callable

from lgmd_gym.envs.scenarios.scenario import Scenario

START_TTC = 5.0
"""A run starts this long before the first possible contact at the scripted speeds: 1 s of undisturbed
driving before the protocols' T0 at 4 s time to contact, so that braking at once counts as premature [s]."""
AFTERMATH = 6.0
"""A run may last this long past the scripted contact, for a slow stop to be seen to its end [s]."""

Family = Callable[..., Scenario]
FAMILIES: dict[str, Family] = {}


def family(name: str) -> Callable[[Family], Family]:
    """Enter a scenario function into `FAMILIES`; a name is given once."""

    def enter(function: Family) -> Family:
        if name in FAMILIES:
            raise ValueError(f"scenario family {name!r} is defined twice")
        FAMILIES[name] = function
        return function

    return enter

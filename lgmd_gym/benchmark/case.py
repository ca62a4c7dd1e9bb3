"""One case of a suite, and the making of rows of them."""

from dataclasses import dataclass
from typing import Any

from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.registration import RANDOM
from lgmd_gym.envs.scenarios.catalogue import make_scenario
from lgmd_gym.envs.scenarios.distribution import draw_scenario, level_generator
from lgmd_gym.envs.scenarios.scenario import Scenario


@dataclass(frozen=True, slots=True)
class Case:
    """One scenario of a suite.

    Attributes:
        name: "suite/family/what", stable across versions.
        family: The scenario family, as in the id `LGMD/<family>-v0`.
        arguments: The environment's keyword arguments, in SI units.
        fcw_driver: Whether the car does not brake by itself: the protocol's driver brakes 1.2 s after
            the agent's alert (Euro NCAP AEB C2C v4.3.1, 8.4.6).
    """

    name: str
    family: str
    arguments: tuple[tuple[str, Any], ...]
    fcw_driver: bool = False

    @property
    def suite(self) -> str:
        """The suite's name."""
        return self.name.split("/")[0]

    @property
    def scenario(self) -> Scenario:
        """What happens in it."""
        arguments = dict(self.arguments)
        if self.family == RANDOM:
            return draw_scenario(level_generator(arguments["split"], arguments["start_level"]))
        arguments.pop("condition", None)  # is the eye's affair
        return make_scenario(self.family, **arguments)


def level(suite: str, split: str, number: int) -> Case:
    """Return a level of `LGMD/RandomBraking-v0` as a case."""
    family = draw_scenario(level_generator(split, number)).family
    return Case(
        f"{suite}/{family}/level{number:03d}",
        RANDOM,
        (("split", split), ("start_level", number), ("num_levels", 1)),
    )


def metres(kmh: float) -> float:
    """Return km/h as m/s, rounded so that names and rows are tidy."""
    return round(kmh * KMH, 6)


def one(suite: str, family: str, what: str, **arguments: Any) -> Case:
    """Return the case `suite/family/what`."""
    return Case(f"{suite}/{family}/{what}", family, tuple(arguments.items()))


def cases(
    suite: str, family: str, speeds_kmh: list[int], tail: str = "", **arguments: Any
) -> tuple[Case, ...]:
    """Return one case per ego speed; `tail` and `arguments` are the same for all."""
    return tuple(
        one(suite, family, f"v{speed}{tail}", ego_speed=metres(speed), **arguments) for speed in speeds_kmh
    )

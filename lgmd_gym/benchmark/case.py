"""One case of a suite, and helpers that build cases."""

from dataclasses import dataclass
from typing import Any

from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.data import scenario_from_data, scenario_to_data
from lgmd_gym.envs.families.distribution import check_families, draw_scenario, level_generator
from lgmd_gym.envs.families.family import make_scenario
from lgmd_gym.envs.families.scenario import Scenario
from lgmd_gym.envs.registration import APPEARANCE, RANDOM, SCENARIO, SCENARIO_ARGUMENT
from lgmd_gym.errors import check_flag, check_items, check_text


@dataclass(frozen=True, slots=True)
class Case:
    """One scenario of a suite.

    Attributes:
        name: "suite/family/variant", stable across versions.
        family: Scenario family, as in the id `LGMD/<family>-v0`; "Scenario" for a case with a given scenario;
            for traffic, the kind of traffic.
        arguments: Keyword arguments of the environment, in SI units.
        fcw_driver: Whether the protocol's driver brakes, 1.2 s after the agent's alert, instead of the
            agent (Euro NCAP AEB C2C v4.3.1, 8.4.6).
    """

    name: str
    family: str
    arguments: tuple[tuple[str, Any], ...] = ()
    fcw_driver: bool = False

    def __post_init__(self) -> None:
        check_text("name", self.name)
        check_text("family", self.family)
        check_flag("fcw_driver", self.fcw_driver)
        for item in check_items("arguments", self.arguments, tuple, "tuples"):
            check_text("arguments: name", item[0] if len(item) == 2 else item)

    @property
    def suite(self) -> str:
        """Name of the suite."""
        return self.name.split("/")[0]

    @property
    def scenario(self) -> Scenario:
        """Scenario of the case.

        Raises:
            ValueError: If an argument is unknown or out of range.
        """
        arguments = {name: value for name, value in self.arguments if name not in APPEARANCE}
        if self.family == RANDOM:
            families = check_families(arguments.get("families"))
            return draw_scenario(level_generator(arguments["split"], arguments["start_level"]), families)
        if self.family == SCENARIO:
            return scenario_from_data(arguments[SCENARIO_ARGUMENT])
        return make_scenario(self.family, **arguments)


def to_mps(kmh: float) -> float:
    """Return a speed in km/h as m/s, rounded to six decimals."""
    return round(kmh * KMH, 6)


def make_case(suite: str, family: str, variant: str, **arguments: Any) -> Case:
    """Return the case `suite/family/variant`."""
    return Case(f"{suite}/{family}/{variant}", family, tuple(arguments.items()))


def scenario_case(
    suite: str, variant: str, scenario: Scenario, fcw_driver: bool = False, **arguments: Any
) -> Case:
    """Return the case `suite/family/variant` with a given scenario, which it holds as plain data.

    Args:
        suite: Name of the suite.
        variant: Last part of the case's name.
        scenario: The scenario; its family is the second part of the name.
        fcw_driver: See `Case`.
        **arguments: Further arguments of the environment, such as `condition`.
    """
    values = {SCENARIO_ARGUMENT: scenario_to_data(scenario)} | arguments
    return Case(f"{suite}/{scenario.family}/{variant}", SCENARIO, tuple(values.items()), fcw_driver)


def speed_cases(
    suite: str, family: str, speeds_kmh: list[int], tail: str = "", **arguments: Any
) -> tuple[Case, ...]:
    """Return one case per ego speed, with the same name suffix and arguments for all."""
    return tuple(
        make_case(suite, family, f"v{speed}{tail}", ego_speed=to_mps(speed), **arguments)
        for speed in speeds_kmh
    )


def level_case(suite: str, split: str, number: int) -> Case:
    """Return one level of `LGMD/RandomBraking-v0` as a case."""
    family = draw_scenario(level_generator(split, number)).family
    return Case(
        f"{suite}/{family}/level{number:03d}",
        RANDOM,
        (("split", split), ("start_level", number), ("num_levels", 1)),
    )

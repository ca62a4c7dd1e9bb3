"""Threats without their target: an agent that brakes there does not brake for the target."""

from collections.abc import Iterable

from lgmd_gym.benchmark.case import Case, scenario_case
from lgmd_gym.envs.families.scenario import without_target
from lgmd_gym.envs.registration import APPEARANCE

SUFFIX = "-without-target"
"""Ending of the names of these suites, after the name of the suite with targets."""


def without_targets(suite: str, cases: Iterable[Case]) -> tuple[Case, ...]:
    """Return the cases of a suite without their targets, in the same order and with the same variants.

    With the order, they also have the worlds of the cases with targets, see `RunConfig.world`. The grey
    levels of the other actors may differ, because they are drawn in the order of the actors.

    Args:
        suite: Name of the suite with targets; the names of the cases begin with it and `SUFFIX`.
        cases: Its cases.
    """
    return tuple(
        scenario_case(
            suite + SUFFIX,
            case.name.split("/", 2)[2],
            without_target(case.scenario),
            case.fcw_driver,
            **{name: value for name, value in case.arguments if name in APPEARANCE},
        )
        for case in cases
    )

"""Threats without their target: an agent that brakes there does not brake for the target."""

from collections.abc import Iterable
from dataclasses import replace

from lgmd_gym.benchmark.case import Case, scenario_case
from lgmd_gym.envs.scenarios.scenario import Scenario, without_target


def without_targets(suite: str, cases: Iterable[Case]) -> tuple[Case, ...]:
    """Return cases with the scenarios of others without their targets, each scenario once per family.

    The name of a case is that of the first one with its scenario. Scenarios that differ only in their
    duration, which depends on the target, are the same. Cases with a driver who brakes are omitted.
    """
    scenarios: dict[Scenario, tuple[str, Scenario]] = {}
    for case in cases:
        if case.fcw_driver:
            continue
        scenario = without_target(case.scenario)
        variant = case.name.split("/", 2)[2]
        scenarios.setdefault(replace(scenario, duration=1.0), (variant, scenario))
    return tuple(scenario_case(suite, variant, scenario) for variant, scenario in scenarios.values())

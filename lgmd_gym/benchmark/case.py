"""Cases, suites with the limits and points of their protocol, and rows of `episodes.jsonl`."""

import re
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypedDict

from lgmd_gym.aliases import Values
from lgmd_gym.camera import CLEAR
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.data import scenario_from_data, scenario_to_data
from lgmd_gym.envs.families.distribution import check_families, draw_scenario, level_generator
from lgmd_gym.envs.families.family import make_scenario
from lgmd_gym.envs.families.scenario import Scenario
from lgmd_gym.envs.registration import APPEARANCE, RANDOM, SCENARIO, SCENARIO_ARGUMENT
from lgmd_gym.errors import check_flag, check_items, check_text

NO_BRAKE = "no-brake"  # the agent that defines threats
TRAFFIC = "traffic"  # the first suite without fixed cases, see `lgmd_gym.benchmark.traffic`
TRAFFIC_SUITES = {TRAFFIC: "attentive", "traffic-inattentive": "inattentive"}
"""The suites of traffic, with the name of the `Attention` of their drivers."""
SEPARATOR = "/"  # between suite, family and variant in the name of a case; a variant may contain it
_UNNAMED = re.compile(r"[^\w.+-]+")


def file_name(text: str) -> str:
    """Return a text with the characters of names of suites and cases only."""
    return _UNNAMED.sub("-", text).strip("-") or "cell"


@dataclass(frozen=True, slots=True)
class Case:
    """One scenario of a suite.

    Attributes:
        suite: Name of the suite.
        family: Scenario family, such as "CCRs", or the name of its random levels, such as "LowBox"; for
            traffic, the kind of traffic.
        variant: What distinguishes the case in its family; with suite and family its name.
        arguments: Keyword arguments of the environment, in SI units.
        environment: The name in the id `LGMD/<environment>-v0`; empty for the family. "Scenario" for a given
            scenario, and "RandomBraking" for a level.
        fcw_driver: Whether the protocol's driver brakes, 1.2 s after the agent's alert, instead of the
            agent (Euro NCAP AEB C2C v4.3.1, 8.4.6).
        load: Load of the car whose limit the protocol sets, "laden" or "unladen"; empty for none.
        swept: Arguments that a sweep varies, each with its value as in the variant, such as
            ("gap", "gap8m"). All cells of a sweep are run in the same worlds.
    """

    suite: str
    family: str
    variant: str
    arguments: tuple[tuple[str, Any], ...] = ()
    environment: str = ""
    fcw_driver: bool = False
    load: str = ""
    swept: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        for name in ("suite", "family", "variant", "environment", "load"):
            check_text(name, getattr(self, name))
        for name in ("suite", "family"):
            if SEPARATOR in getattr(self, name):
                raise ValueError(
                    f"{name} must not contain {SEPARATOR!r}, the separator of case names, got "
                    f"{getattr(self, name)!r}"
                )
        check_flag("fcw_driver", self.fcw_driver)
        for item in check_items("arguments", self.arguments, tuple, "tuples"):
            check_text("arguments: name", item[0] if len(item) == 2 else item)
        if not self.environment:
            object.__setattr__(self, "environment", self.family)

    @property
    def name(self) -> str:
        """The text "suite/family/variant", stable across versions."""
        return f"{self.suite}/{self.family}/{self.variant}"

    def argument(self, name: str, default: object = None) -> Any:
        """Return an argument of the environment, or a default if the case does not state it."""
        return dict(self.arguments).get(name, default)

    @property
    def appearance(self) -> Values:
        """Arguments that set the appearance, such as `weather`."""
        return {name: value for name, value in self.arguments if name in APPEARANCE}

    @property
    def speed(self) -> float | None:
        """Test speed of the ego [m/s]; None where the family's default or a level determines it."""
        given = self.argument(SCENARIO_ARGUMENT)
        speed = self.argument("ego_speed") if given is None else given.get("ego_speed")
        return None if speed is None else float(speed)

    @property
    def scenario(self) -> Scenario:
        """Scenario of the case.

        Raises:
            ValueError: If an argument is unknown or out of range.
        """
        arguments = {name: value for name, value in self.arguments if name not in APPEARANCE}
        if self.environment == RANDOM:
            families = check_families(arguments.get("families"))
            return draw_scenario(level_generator(arguments["split"], arguments["start_level"]), families)
        if self.environment == SCENARIO:
            return scenario_from_data(arguments[SCENARIO_ARGUMENT])
        return make_scenario(self.environment, **arguments)


RowKey = tuple[str, str, int, str]
"""Agent, case, seed and condition."""
ID_KEYS = ("agent", "suite", "case", "fcw_driver", "seed", "condition")


class EpisodeRow(TypedDict):
    """Keys of every row; null where undefined, SI units.

    `world` is null in the laboratory. `error` is the traceback of an episode that failed.
    """

    agent: str
    suite: str
    case: str
    fcw_driver: bool
    seed: int
    condition: str
    world: int | None
    camera: str | None
    family: str
    threat: bool
    collision: bool
    avoided: bool
    impact_speed: float | None
    relative_impact_speed: float | None
    peak_deceleration: float
    distance: float
    duration: float
    fps: float
    error: str | None


class Row(EpisodeRow):
    """Row of a suite of cases: the fields of the case, and the metrics, whose docstrings define them.

    `test_speed` is null for a start from standstill and for levels. `light` is the weather that the
    case prescribes, null for that of the run. `avoided` and `speed_reduction` are null without a threat; the
    types are those of a threat without an error.
    """

    test_speed: float | None
    test_target_speed: float | None
    overlap: float | None
    impact_location: float | None
    target_side: str | None
    light: str | None
    load: str | None
    ego_speed: float
    target_speed: float | None
    target_shade: float | None
    speed_reduction: float
    ttc_at_alert: float | None
    distance_at_alert: float | None
    theta_at_alert_deg: float | None
    l_over_v_ms: float | None
    warning_lead_time: float | None
    ttc_at_brake: float | None
    distance_at_brake: float | None
    drac_at_brake: float | None
    max_drac: float | None
    min_ttc: float | None
    stopping_margin: float | None
    false_activation: bool
    false_alert: bool
    braking_onsets: int
    premature_brake: bool
    episode_return: float


class Points(NamedTuple):
    """Points of one scenario of a protocol, mean over seeds."""

    scenario: str
    earned: float
    maximum: float
    exact: bool  # False for a lower bound
    note: str = ""  # reason for no points


@dataclass(frozen=True, slots=True, kw_only=True)
class Suite:
    """A named list of cases with the limits and points of its protocol.

    Attributes:
        name: Name of the suite, the first part of every case name.
        cases: Cases in the order in which they run.
        about: One line on its source and limits.
        limit: Compares a row with its limit; returns whether the row meets it, and the limit in words.
        verdict: Name of a requirement on all rows of an agent, and the function that checks it.
        colour: Returns the colour of a row in grids.
        points: Returns the points of an agent.
    """

    name: str
    cases: tuple[Case, ...]
    about: str
    limit: Callable[[Row], tuple[bool, str]] | None = None
    verdict: tuple[str, Callable[[list[Row], str], bool]] | None = None
    colour: Callable[[Row], str] | None = None
    points: Callable[[list[Row], str], list[Points]] | None = None
    by_name: dict[str, Case] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "by_name", {case.name: case for case in self.cases})


def to_mps(kmh: float) -> float:
    """Return a speed in km/h as m/s, rounded to six decimals."""
    return round(kmh * KMH, 6)


def make_case(suite: str, family: str, variant: str, **arguments: object) -> Case:
    """Return the case `suite/family/variant`."""
    return Case(suite, family, variant, tuple(arguments.items()))


def scenario_case(
    suite: str, variant: str, scenario: Scenario, fcw_driver: bool = False, **arguments: object
) -> Case:
    """Return the case `suite/family/variant` with a given scenario, which it holds as plain data."""
    values = {SCENARIO_ARGUMENT: scenario_to_data(scenario)} | arguments
    return Case(suite, scenario.family, variant, tuple(values.items()), SCENARIO, fcw_driver)


def speed_cases(
    suite: str, family: str, speeds_kmh: Sequence[int], tail: str = "", **arguments: object
) -> tuple[Case, ...]:
    """Return one case per ego speed, with the same name suffix and arguments for all."""
    return tuple(
        make_case(suite, family, f"v{speed}{tail}", ego_speed=to_mps(speed), **arguments)
        for speed in speeds_kmh
    )


def level_case(suite: str, split: str, number: int) -> Case:
    """Return one level of `LGMD/RandomBraking-v0` as a case."""
    family = draw_scenario(level_generator(split, number)).family
    arguments = (("split", split), ("start_level", number), ("num_levels", 1))
    return Case(suite, family, f"level{number:03d}", arguments, RANDOM)


def is_traffic(suite: object) -> bool:
    """Return whether a suite is one of traffic."""
    return isinstance(suite, str) and suite in TRAFFIC_SUITES


def traffic_case(kind: str, seed: int, suite: str = TRAFFIC) -> Case:
    """Return the case of one seed of a kind of traffic, such as "traffic/highway/s3"."""
    return Case(suite, kind, f"s{seed}")


CASE_KEYS = (
    "family",
    "test_speed",
    "test_target_speed",
    "overlap",
    "impact_location",
    "target_side",
    "light",
    "load",
)


def key_of(row: EpisodeRow) -> RowKey:
    """Return the key of a row, unique within its run: agent, case, seed, condition."""
    return row["agent"], row["case"], row["seed"], row["condition"]


def new_row(
    keys: tuple[str, ...], agent: str, case: Case, seed: int, condition: str = CLEAR, **values: object
) -> Any:
    """Return a row with its identity, the fields of its case and `values`; all other keys are null."""
    identity = (agent, case.suite, case.name, case.fcw_driver, seed, condition)
    fields = {key: value for key, value in case_fields(case).items() if key in keys}
    return dict.fromkeys(keys) | dict(zip(ID_KEYS, identity, strict=True)) | fields | values


def case_fields(case: Case) -> Values:
    """Return the `CASE_KEYS` of a case."""
    speed = None if case.argument("from_stop") else case.speed
    names = ("target_speed", "overlap", "impact_location", "side", "weather")
    values = (case.family, speed, *map(case.argument, names), case.load or None)
    return dict(zip(CASE_KEYS, values, strict=True))


def repetitions(keys: Iterable[Hashable]) -> list[str]:
    """Return "" for the first of equal keys, "/2" for the second, and so on, to make names distinct."""
    seen, suffixes = Counter[Hashable](), list[str]()
    for key in keys:
        seen[key] += 1
        suffixes.append(f"/{seen[key]}" if seen[key] > 1 else "")
    return suffixes


def relative_impact(row: EpisodeRow) -> float:
    """Return the relative impact speed of a row [m/s]; 0 without contact."""
    return row["relative_impact_speed"] or 0.0


def case_order(case: str) -> list[tuple[int, str]]:
    """Return a sort key that compares numbers in a case name by value: v5 before v10."""
    parts = re.split(r"(\d+)", case)
    return [(int(part), "") if part.isdigit() else (0, part) for part in parts]

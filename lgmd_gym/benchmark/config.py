"""The configuration of a run, stored as `run.toml` in its folder, and its provenance."""

import os
import platform
import subprocess
import time
from collections.abc import Collection, Iterable
from dataclasses import asdict, dataclass, fields
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from itertools import product
from pathlib import Path
from typing import Any

import tomli_w

from lgmd_gym._version import __version__
from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.case import NO_BRAKE, RowKey, Suite, is_traffic, traffic_case
from lgmd_gym.benchmark.case_table import read_data
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import OWN, Source, copy_suite, get_suite, is_file
from lgmd_gym.camera.scene import CLEAR, WEATHERS
from lgmd_gym.camera.worlds import SPLIT_WORLDS, WORLDS
from lgmd_gym.envs.appearance import MIXED, Appearance
from lgmd_gym.envs.families.scenario import Scenario
from lgmd_gym.envs.registration import TRAFFIC_KINDS
from lgmd_gym.errors import as_tuple, check_items, check_keys, check_known, check_text, check_whole, shown
from lgmd_gym.neuron import LGMDParams, NeuronSpec, check_model, outside_code
from lgmd_gym.sensing.channel import ChannelSpec, make_channels

PACKAGES = ("numpy", "numba", "gymnasium", "highway-env", "joblib")


def provenance() -> Values:
    """Return the versions, commit, processor and date of this run."""
    return {
        "lgmd_gym": __version__,
        "commit": _commit(),
        "python": platform.python_version(),
        "packages": {name: _version(name) for name in PACKAGES},
        "processor": _processor(),
        "cpus": os.cpu_count(),
        "finished": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
    }


@cache
def _commit() -> str | None:
    """Return the commit of the source tree that holds this package; None for an installed package."""
    if not (Path(__file__).parents[2] / "pyproject.toml").is_file():
        return None
    try:
        described = subprocess.run(
            ["git", "describe", "--always", "--dirty"],
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return described.stdout.strip() or None


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


RUN_FILE = "run.toml"
_WORLD_STEP = 7  # worlds between the first seeds of one case and of the next
SUITE_FILE = "suite.toml"  # copy of a user's own suite next to it
DEFAULT_AGENTS = (
    NO_BRAKE,
    "always-brake",
    "random-brake",
    "spike-threshold",
    "stopping-zone",
    "ttc-oracle",
)
HEAD = "# Repeat with lgmd-gym bench --config {file}. Made by lgmd-gym {version}, commit {commit}.\n"


@dataclass(frozen=True, slots=True, kw_only=True)
class RunConfig:
    """Configuration of a run: every setting that affects its rows.

    Attributes:
        suite: Name of a suite; path of a suite file or scenario file (".toml" or ".json") or of an
            OpenSCENARIO file (".xosc"); path of a folder with OpenSCENARIO files; a `Scenario`; several paths
            and scenarios; or "traffic" or "traffic-inattentive".
        agents: Agent strings, such as "spike-threshold:threshold=45" or "my_module:MyAgent".
        seeds: Number of seeds, >= 1; for traffic, of every kind.
        first_seed: First seed, >= 0.
        conditions: Weathers by name, or "mixed" for that of each world; the suite is run under each.
        worlds: Number of worlds, over which the runs of each case are distributed; 0 for the laboratory.
        first_world: Number of the first world.
        road: Road that moves the car's body, see `Appearance`.
        camera: See `LGMDObservation`; None for each agent's own, see `Agent.camera`.
        params: See `LGMDObservation`; None for each agent's own or the defaults.
        neuron: Model of cameras without one of their own, as in "off-only:t_sp=0.78" or
            "my_module:Mine"; None for the LGMD.
        kinds: Kinds of traffic; None for all. Only for the suites of traffic.
        modules: Modules with scenario families of the user, see `import_families`; a run folder stores the
            scenarios instead.

    Raises:
        ValueError: If a value is unknown or out of range.
    """

    suite: Source = "quick"
    agents: tuple[str, ...] = DEFAULT_AGENTS
    seeds: int = 3
    first_seed: int = 0
    conditions: tuple[str, ...] = (CLEAR,)
    worlds: int = 20
    first_world: int = SPLIT_WORLDS["test"].start
    road: str | None = None
    camera: ChannelSpec | None = None
    params: NeuronSpec = None
    neuron: str | None = None
    kinds: tuple[str, ...] | None = None
    modules: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "suite", _suite(self.suite))
        if self.kinds is not None and not is_traffic(self.suite):
            raise ValueError(f"kinds applies to suites of traffic only, got suite {shown(self.suite)}")
        if self.camera is not None:
            make_channels(self.camera)
        LGMDParams.make(self.params)
        plain = SensorConfig(self.camera, self.params).plain
        values: Values = {
            "seeds": check_whole("seeds", self.seeds, 1),
            "first_seed": check_whole("first_seed", self.first_seed, 0),
            "agents": _names("agents", self.agents),
            "conditions": _names("conditions", self.conditions, "weather", (*WEATHERS, MIXED)),
            "worlds": check_whole("worlds", self.worlds, 0, WORLDS),
            "first_world": check_whole("first_world", self.first_world, 0, WORLDS - max(self.worlds, 1)),
            "modules": tuple(dict.fromkeys(check_items("modules", self.modules, str, "strings"))),
            "camera": plain.camera,
            "params": plain.params,
        }
        Appearance(road=self.road)  # checks it
        if self.neuron is not None and outside_code(check_text("neuron", self.neuron)) is None:
            check_model("neuron", self.neuron)  # that of a module is imported when the run is checked
        if is_traffic(self.suite):
            kinds = tuple(TRAFFIC_KINDS) if self.kinds is None else self.kinds
            values["kinds"] = _names("kinds", kinds, "kind of traffic", TRAFFIC_KINDS)
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def seed_range(self) -> range:
        """The seeds."""
        return range(self.first_seed, self.first_seed + self.seeds)

    def world(self, seed: int, case_index: int) -> int | None:
        """Return the world of a run; None for the laboratory.

        With as many seeds as worlds, each case is run once in each world. With fewer, the cases are run in
        different ones; those of a sweep have the index 0, so that they differ in the swept arguments only.
        """
        if self.worlds == 0:
            return None
        return self.first_world + (seed + _WORLD_STEP * case_index) % self.worlds

    @property
    def sensor_config(self) -> SensorConfig:
        """Camera and neuron parameters."""
        return SensorConfig(self.camera, self.params, neuron=self.neuron)

    def sensors(self, condition: str) -> SensorConfig:
        """Return camera and neuron parameters for a weather, which the environment shows.

        Raises:
            ValueError: If a camera is a top view, which shows no weather.
        """
        if condition not in (CLEAR, MIXED) and self.sensor_config.has_top_view:
            raise ValueError(f"camera 'birdseye' does not support condition {condition!r}; use 'clear'")
        return self.sensor_config

    def get_suite(self) -> Suite:
        """Return the suite; those of traffic have no fixed cases."""
        if is_traffic(self.suite):
            return Suite(name=str(self.suite), cases=(), about="recorded traffic")
        return get_suite(self.suite, self.modules)

    def row_keys(self, suite: Suite) -> set[RowKey]:
        """Return the keys of all rows of a complete run; of cases, those of `no-brake` included."""
        seeds, conditions = self.seed_range, self.conditions
        if is_traffic(self.suite):
            return {
                (agent, traffic_case(kind, seed, suite.name).name, seed, condition)
                for agent, kind, seed, condition in product(self.agents, self.kinds or (), seeds, conditions)
            }
        cases = [case.name for case in suite.cases]
        return set(product({NO_BRAKE, *self.agents}, cases, seeds, conditions))

    @property
    def own_suite(self) -> bool:
        """Whether the suite is given by files of the user."""
        return is_file(self.suite)

    @property
    def label(self) -> str:
        """Short name of the suite, for names of folders."""
        first = self.suite[0] if isinstance(self.suite, tuple) else self.suite
        return Path(first).stem if isinstance(first, str) else OWN

    @classmethod
    def load(cls, path: Path) -> "RunConfig":
        """Read a file written by `save`; the path of a suite file is relative to it.

        Raises:
            ValueError: If the file cannot be read, a key is unknown or missing, or a value is invalid.
        """
        values = read_data(path, "run config")
        try:
            check_keys("key", values, [field.name for field in fields(cls) if field.name != "modules"])
            for key in ("suite", "agents", "seeds"):
                if key not in values:
                    raise ValueError(f"key {key!r} is missing")
            config = cls(**values)
        except ValueError as error:
            raise ValueError(f"run config {str(path)!r}: {error}") from None
        if config.own_suite:
            suites = config.suite if isinstance(config.suite, tuple) else (config.suite,)
            paths = tuple(str(path.parent / str(suite)) for suite in suites)
            object.__setattr__(config, "suite", _suite(paths))
        return config

    def save(self, folder: Path) -> Path:
        """Write `run.toml`, and a copy of a user's own suite, into a run folder; return the file's path."""
        made = provenance()
        if self.own_suite:
            copy_suite(self.suite, folder / SUITE_FILE, self.modules)
        head = HEAD.format(file=RUN_FILE, version=made["lgmd_gym"], commit=made["commit"] or "unknown")
        values = {key: value for key, value in self.to_dict().items() if value is not None}
        path = folder / RUN_FILE
        path.write_text(head + tomli_w.dumps(values), encoding="utf-8")
        return path

    def to_dict(self) -> Values:
        """Return the values for TOML and JSON; a user's own suite is `SUITE_FILE`."""
        values = asdict(self) | ({"suite": SUITE_FILE} if self.own_suite else {})
        del values["modules"]
        return values


def _suite(value: Any) -> Source:
    """Return the name or path of a suite, a scenario, or several; a single one is not a tuple."""
    items = (value,) if isinstance(value, str | Path | Scenario) else as_tuple(value)
    if items is None or not all(isinstance(item, str | Path | Scenario) for item in items):
        raise ValueError(f"suite must be a name, paths or scenarios, got {shown(value)}")
    if not items:
        raise ValueError("suite must contain at least one name or path, or a scenario, got none")
    items = tuple(str(item) if isinstance(item, Path) else item for item in items)
    return items[0] if len(items) == 1 else items


def _names(name: str, values: Iterable[str], kind: str = "", known: Collection[str] = ()) -> tuple[str, ...]:
    """Return the distinct names; raise ValueError for an unknown one, or if there are none."""
    names = tuple(dict.fromkeys(check_items(name, values, str, "strings")))
    if not names:
        raise ValueError(f"{name} must contain at least one name, got none")
    for value in names:
        if kind:
            check_known(kind, value, known)
    return names

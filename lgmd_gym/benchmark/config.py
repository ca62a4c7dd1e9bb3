"""What a run plays, as `run.toml` in its folder: `lgmd-gym bench --config run.toml` plays the same again."""

from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import tomli_w

from lgmd_gym.benchmark.folder import provenance
from lgmd_gym.benchmark.sensors import CLEAR, SensorConfig
from lgmd_gym.benchmark.suite_file import read_toml
from lgmd_gym.errors import check_keys

FILE = "run.toml"
OWN_SUITE = "suite.toml"  # beside it, if the suite is a user's own
HEAD = (
    "# lgmd-gym bench --config {file} plays the same again. Played by lgmd-gym {version}, commit {commit}.\n"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunConfig:
    """Everything that decides a run's rows; not on how many processes, nor where.

    Attributes:
        suite: A suite's name, or the path of a suite file.
        agents: Agent strings.
        seeds: Number of seeds, >= 1.
        conditions: Camera conditions by name, each of which is played.
        camera: See `LGMDObservation`; plain values, None for each agent's own eye.
        params: See `LGMDObservation`; plain values, None for the defaults.
        first_seed: Seeds are played from this one on, >= 0.
    """

    suite: str
    agents: tuple[str, ...]
    seeds: int
    conditions: tuple[str, ...] = (CLEAR,)
    camera: Any = None
    params: dict[str, Any] | None = None
    first_seed: int = 0

    def __post_init__(self) -> None:
        for name, low in (("seeds", 1), ("first_seed", 0)):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < low:
                raise ValueError(f"{name} must be a whole number >= {low}, got {value!r}")

    @property
    def played(self) -> range:
        """The seeds."""
        return range(self.first_seed, self.first_seed + self.seeds)

    @property
    def sensor_config(self) -> SensorConfig:
        """Camera and neuron parameters, before any condition."""
        return SensorConfig(self.camera, self.params)

    @classmethod
    def load(cls, path: Path) -> "RunConfig":
        """Read a file; a suite file is looked for beside it.

        Raises:
            ValueError: For a file that cannot be read, a key that is unknown (the nearest is named) or
                missing, or a value of another kind.
        """
        values = read_toml(path, "run config")
        try:
            return cls._from_values(values, path.parent)
        except ValueError as error:
            raise ValueError(f"run config {str(path)!r}: {error}") from None

    @classmethod
    def _from_values(cls, values: dict[str, Any], folder: Path) -> "RunConfig":
        check_keys("key", values, [field.name for field in fields(cls)])
        for key in ("suite", "agents", "seeds"):
            if key not in values:
                raise ValueError(f"key {key!r} is missing")
        if not isinstance(values["suite"], str):
            raise ValueError(f"suite must be a string, got {values['suite']!r}")
        for key in ("agents", "conditions"):
            items = values.get(key, [CLEAR])
            if not isinstance(items, list) or not all(isinstance(item, str) for item in items):
                raise ValueError(f"{key} must be a list of strings, got {items!r}")
            values[key] = tuple(items)
        if values["suite"].endswith(".toml"):
            values["suite"] = str(folder / values["suite"])
        return cls(**values)

    def save(self, path: Path) -> None:
        """Write a file that `load` reads back; its first line says what it was played with."""
        made = provenance()
        values = {key: value for key, value in asdict(self).items() if value is not None}
        head = HEAD.format(file=path.name, version=made["lgmd_gym"], commit=made["commit"] or "unknown")
        path.write_text(head + tomli_w.dumps(values), encoding="utf-8")

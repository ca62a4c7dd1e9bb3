"""Search space: a rule's parameters and, on request, its camera, camera geometry and neuron parameters."""

from dataclasses import dataclass, fields
from math import inf
from typing import Any

from lgmd_gym.agents import AGENTS, Rule, make_agent
from lgmd_gym.agents.rules import CAMERA
from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.camera import PRESETS
from lgmd_gym.errors import check_flag, check_items, check_known
from lgmd_gym.fields import Declaration, declarations
from lgmd_gym.neuron import LGMDParams

CAMERA_KEY, NEURON_PREFIX = "camera", "neuron."  # keys of a proposal in addition to the rule's parameters
NEURON_FACTOR = 2.0  # neuron parameters are searched from default / factor to default * factor, in bounds
SHIFT = 0.2  # relative shift of each parameter in the sensitivity table

# A flat dict: the rule's parameters by name, the camera preset as "camera" and neuron parameters as in
# "neuron.sigma_3". Missing parameters keep their defaults.
Proposal = Values


@dataclass(frozen=True, kw_only=True)
class SearchSpace:
    """Search space of one rule.

    Raises:
        ValueError: For an unknown name, cameras for a rule with several cameras, or a neuron parameter whose
            default is not a finite number > 0.
    """

    agent: str  # name of a rule
    # camera presets to choose from, for a rule with one camera; empty to keep the rule's camera
    cameras: tuple[str, ...] = ()
    camera_geometry: bool = False  # whether to search the parameters that determine the rule's own cameras
    neuron: tuple[str, ...] = ()  # names of the neuron parameters (`LGMDParams`) to search

    def __post_init__(self) -> None:
        rule_class(self.agent)
        check_flag("camera_geometry", self.camera_geometry)
        for camera in check_items("cameras", self.cameras, str, "names"):
            check_known("camera", camera, PRESETS)
        if self.cameras and isinstance(make_agent(self.agent).camera, list):
            raise ValueError(
                f"{self.agent} has several cameras of its own, got cameras {list(self.cameras)}; "
                "use camera_geometry instead"
            )
        for name in check_items("neuron", self.neuron, str, "names"):
            check_known("neuron parameter", name, neuron_defaults())

    @property
    def label(self) -> str:
        """Name that distinguishes studies of different spaces."""
        geometry = ["camera geometry"] if self.camera_geometry else []
        parts = (*self.cameras, *geometry, *self.neuron)
        return " ".join((self.agent, *(["with", *parts] if parts else [])))

    def defaults(self) -> Proposal:
        """Return the default of every searched parameter."""
        proposal: Proposal = {item.name: item.default for item in self._searched_fields()}
        if self.cameras:
            proposal[CAMERA_KEY] = self.cameras[0]
        return proposal | {NEURON_PREFIX + name: neuron_defaults()[name] for name in self.neuron}

    def propose(self, trial: Any) -> Proposal:
        """Return the parameters that an Optuna trial suggests."""
        proposal: Proposal = {}
        for item in self._searched_fields():
            low, high = item.search or (item.default, item.default)
            suggest = trial.suggest_int if isinstance(item.default, int) else trial.suggest_float
            proposal[item.name] = suggest(item.name, low, high)
        if self.cameras:
            proposal[CAMERA_KEY] = trial.suggest_categorical(CAMERA_KEY, self.cameras)
        for name in check_items("neuron", self.neuron, str, "names"):
            key, (low, high) = NEURON_PREFIX + name, neuron_range(name)
            proposal[key] = trial.suggest_float(key, low, high, log=True)
        return proposal

    def shifts(self) -> list[tuple[str, float | int, Proposal]]:
        """Return name, value and proposal for each parameter shifted by 20 % down and up.

        Whole numbers shift by at least 1. The camera preset is not shifted; the parameters of the camera
        geometry are.
        """
        shifts: list[tuple[str, float | int, Proposal]] = []
        values: Proposal = rule_class(self.agent).options() | self.defaults()
        values.pop(CAMERA_KEY, None)
        for name, value in values.items():
            for sign in (-1, 1):
                shifted: float | int = float(f"{value * (1 + sign * SHIFT):.6g}")
                if isinstance(value, int):
                    shifted = max(1, value + sign * max(1, round(SHIFT * value)))
                shifts.append((name, shifted, {name: shifted}))
        return shifts

    def _searched_fields(self) -> list[Declaration]:
        items = declarations(rule_class(self.agent).Params)
        return [item for item in items if self.camera_geometry or item.group != CAMERA]


def rule_options(proposal: Proposal) -> Proposal:
    """Return the rule parameters among proposed parameters."""
    names = (name for name in proposal if name != CAMERA_KEY and not name.startswith(NEURON_PREFIX))
    return {name: proposal[name] for name in names}


def neuron_params(proposal: Proposal) -> Proposal:
    """Return the neuron parameters among proposed parameters, without their prefix."""
    names = [name for name in proposal if name.startswith(NEURON_PREFIX)]
    return {name.removeprefix(NEURON_PREFIX): proposal[name] for name in names}


def sensor_config(proposal: Proposal) -> SensorConfig:
    """Return the sensor configuration for proposed parameters."""
    return SensorConfig(proposal.get(CAMERA_KEY), neuron_params(proposal) or None)


def agent_string(agent: str, proposal: Proposal) -> str:
    """Return the agent string for a rule with proposed parameters."""
    options = rule_options(proposal)
    return agent + ":" * bool(options) + ",".join(f"{name}={value!r}" for name, value in options.items())


def rule_class(agent: str) -> type[Rule]:
    """Return the class of a rule.

    Raises:
        ValueError: If there is no rule with this name.
    """
    rules = {name: cls for name, cls in AGENTS.items() if issubclass(cls, Rule)}
    check_known("rule", agent, rules)
    return rules[agent]


def neuron_range(name: str) -> tuple[float, float]:
    """Return the searched range of a neuron parameter: half to twice its default, within its bounds."""
    default, (declared,) = neuron_defaults()[name], [x for x in declarations(LGMDParams) if x.name == name]
    highest = declared.interval.high if declared.interval else inf
    return default / NEURON_FACTOR, min(default * NEURON_FACTOR, highest)


def neuron_defaults() -> dict[str, float]:
    """Return the neuron parameters that can be scaled (finite floats > 0) with their defaults."""
    defaults = {item.name: item.default for item in fields(LGMDParams)}
    return {name: x for name, x in defaults.items() if isinstance(x, float) and 0.0 < x < inf}

"""What tuning may change: a rule's parameters, on demand its lens, what places its cameras, its neuron."""

from dataclasses import MISSING, dataclass, fields
from typing import Any

from lgmd_gym.agents import AGENTS, Rule, make_agent
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.camera import PRESETS
from lgmd_gym.errors import unknown_name
from lgmd_gym.neuron import LGMDParams

CAMERA, NEURON = "camera", "neuron."  # the name of the lens in a proposal, and how those of the neuron begin
FACTOR = 2.0  # the neuron's parameters are searched from half their default to twice
SHIFT = 0.2  # of each parameter in the sensitivity table

Proposal = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Space:
    """What a search may change. A proposal out of it is a flat dict.

    It holds the rule's parameters under their names, the lens as "camera", and the neuron's parameters as
    in "neuron.sigma_3"; what it lacks stays at its default.

    Attributes:
        agent: Name of a rule.
        cameras: Camera presets to choose among, for a rule with one camera; empty for the one it has.
        placing: Whether those parameters are searched, too, on which the rule's own cameras depend.
        neuron: Parameters of the neuron (`LGMDParams`) that are searched.

    Raises:
        ValueError: For an unknown name (the nearest is named), cameras for a rule that needs several, or a
            parameter of the neuron that is no finite number above 0.
    """

    agent: str
    cameras: tuple[str, ...] = ()
    placing: bool = False
    neuron: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        tunable(self.agent)
        for camera in self.cameras:
            if camera not in PRESETS:
                raise unknown_name("camera", camera, PRESETS)
        if self.cameras and isinstance(make_agent(self.agent).camera, list):
            raise ValueError(
                f"{self.agent} needs the cameras of its own eye; search with placing, not cameras"
            )
        for name in self.neuron:
            if name not in scales_of_the_neuron():
                raise unknown_name("number of the neuron", name, scales_of_the_neuron())

    @property
    def rule(self) -> type[Rule]:
        """The rule's class."""
        return tunable(self.agent)

    @property
    def label(self) -> str:
        """What tells one study's space from another's."""
        parts = (*self.cameras, *(["placing"] if self.placing else []), *self.neuron)
        return " ".join((self.agent, *(["with", *parts] if parts else [])))

    def defaults(self) -> Proposal:
        """Return all that is searched at its default."""
        known = defaults(self.rule)
        found: Proposal = {name: known[name] for name in searched(self.rule, self.placing)}
        if self.cameras:
            found[CAMERA] = self.cameras[0]
        return found | {NEURON + name: scales_of_the_neuron()[name] for name in self.neuron}

    def propose(self, trial: Any) -> Proposal:
        """Return a proposal drawn by an Optuna trial."""
        found: Proposal = {}
        for item in fields(self.rule.Params):
            if item.name in searched(self.rule, self.placing):
                low, high = item.metadata["range"]
                draw = trial.suggest_int if isinstance(item.default, int) else trial.suggest_float
                found[item.name] = draw(item.name, low, high)
        if self.cameras:
            found[CAMERA] = trial.suggest_categorical(CAMERA, self.cameras)
        for name in self.neuron:
            value = scales_of_the_neuron()[name]
            low, high = value / FACTOR, value * FACTOR
            found[NEURON + name] = trial.suggest_float(NEURON + name, low, high, log=True)
        return found

    def shifts(self) -> list[tuple[str, float | int, Proposal]]:
        """Return each parameter lowered and raised by a fifth: its name, its value, and the proposal.

        Whole numbers move by at least one. What places the cameras is among them, the lens is not.
        """
        moved: list[tuple[str, float | int, Proposal]] = []
        plain = {name: value for name, value in self.defaults().items() if name != CAMERA}
        for name, value in (defaults(self.rule) | plain).items():
            for sign in (-1, 1):
                shifted: float | int = float(f"{value * (1 + sign * SHIFT):.6g}")
                if isinstance(value, int):
                    shifted = max(1, value + sign * max(1, round(SHIFT * value)))
                moved.append((name, shifted, {name: shifted}))
        return moved


def rule_options(proposal: Proposal) -> Proposal:
    """Return what a proposal says to the rule."""
    return {name: value for name, value in proposal.items() if name != CAMERA and not name.startswith(NEURON)}


def neuron_params(proposal: Proposal) -> Proposal:
    """Return what a proposal says to the neuron."""
    return {name.removeprefix(NEURON): value for name, value in proposal.items() if name.startswith(NEURON)}


def sensor_config(proposal: Proposal) -> SensorConfig:
    """Return what a proposal has its agent see through."""
    return SensorConfig(proposal.get(CAMERA), neuron_params(proposal) or None)


def spelled(agent: str, proposal: Proposal) -> str:
    """Return the string of an agent with a proposal's options."""
    options = rule_options(proposal)
    return agent + ":" * bool(options) + ",".join(f"{name}={value!r}" for name, value in options.items())


def tunable(agent: str) -> type[Rule]:
    """Return the class of a rule, or raise ValueError that names the nearest rule."""
    rules = {name: cls for name, cls in AGENTS.items() if issubclass(cls, Rule)}
    if agent not in rules:
        raise unknown_name("rule", agent, rules)
    return rules[agent]


def searched(rule: type[Rule], placing: bool = False) -> list[str]:
    """Return the names of the parameters that tuning searches; with `placing` also those of its cameras."""
    return [item.name for item in fields(rule.Params) if placing or not item.metadata.get("places_eye")]


def defaults(rule: type[Rule]) -> Proposal:
    """Return a rule's parameters at their defaults."""
    return {item.name: item.default for item in fields(rule.Params)}


def scales_of_the_neuron() -> dict[str, float]:
    """Return the neuron's parameters that can be halved and doubled, with their defaults."""
    known = {item.name: item.default for item in fields(LGMDParams) if item.default is not MISSING}
    return {
        name: value
        for name, value in known.items()
        if isinstance(value, float) and 0.0 < value < float("inf")
    }

"""Base class of the braking and traffic environments."""

from dataclasses import asdict, fields
from typing import Any, ClassVar

from highway_env.envs.common.abstract import AbstractEnv

from lgmd_gym.envs.dynamics.brake import BrakeParams
from lgmd_gym.errors import check_keys


class EgoBrakeEnv(AbstractEnv):
    """A highway-env environment with a strictly checked configuration and `BrakeParams` for the ego.

    Attributes:
        brake: Response of the ego to demands, from the configuration.
    """

    # highway-env writes render_fps into this dict, hence the copy for each instance.
    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["human", "rgb_array"]}

    def __init__(self, config: dict[str, Any] | None = None, render_mode: str | None = None) -> None:
        self.metadata = {**type(self).metadata}  # type: ignore[misc]
        super().__init__(config=config, render_mode=render_mode)  # type: ignore[arg-type]

    @classmethod
    def default_config(cls) -> dict[str, Any]:
        """Return the default configuration."""
        return super().default_config() | {"policy_frequency": 30, **asdict(BrakeParams())}

    def configure(self, config: dict[str, Any] | None) -> None:
        """Apply a configuration.

        Raises:
            ValueError: If a key is unknown or a value is out of range.
        """
        config = dict(config or {})
        check_keys("config key", config, self.config)
        super().configure(config)
        self.brake = BrakeParams(**{field.name: self.config[field.name] for field in fields(BrakeParams)})
        simulation, policy = self.config["simulation_frequency"], self.config["policy_frequency"]
        if policy <= 0 or simulation % policy:
            raise ValueError(
                f"policy_frequency {policy} Hz does not divide simulation_frequency {simulation} Hz; "
                f"choose a divisor, for example {simulation} or {simulation / 2:g} Hz"
            )

"""Base class of the braking and traffic environments."""

from collections.abc import Iterator
from contextlib import contextmanager
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

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; if ``options["config"]`` is refused, the environment stays as it was.

        Args:
            seed: Seed of the environment's random generator; None to continue with the present one.
            options: None, or ``config``, configuration keys that apply from this episode on.

        Raises:
            ValueError: If a configuration key is unknown or a value is out of range.
        """
        with self._unchanged_if_refused():
            return super().reset(seed=seed, options=options)

    def configure(self, config: dict[str, Any] | None) -> None:
        """Apply a configuration; a refused one leaves the environment unchanged.

        Raises:
            ValueError: If a key is unknown or a value is out of range.
        """
        config = dict(config or {})
        check_keys("config key", config, self.config)
        with self._unchanged_if_refused():
            super().configure(config)
            self.brake = BrakeParams(**{field.name: self.config[field.name] for field in fields(BrakeParams)})
            simulation, policy = self.config["simulation_frequency"], self.config["policy_frequency"]
            if policy <= 0 or simulation % policy:
                raise ValueError(
                    f"policy_frequency {policy} Hz does not divide simulation_frequency {simulation} Hz; "
                    f"choose a divisor, for example {simulation} or {simulation / 2:g} Hz"
                )

    @contextmanager
    def _unchanged_if_refused(self) -> Iterator[None]:
        """Undo all changes of the environment's attributes if an error is raised."""
        # Configurations change these two dicts in place and replace all other attributes.
        attributes, config, metadata = {**vars(self)}, {**self.config}, {**self.metadata}
        try:
            yield
        except Exception:
            vars(self).clear()
            vars(self).update(attributes)
            for present, before in ((self.config, config), (self.metadata, metadata)):
                present.clear()
                present.update(before)
            raise

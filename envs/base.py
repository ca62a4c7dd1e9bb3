# pyright: standard
# Not strict: highway-env states few types.
"""Base class of the braking and traffic environments."""

from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import asdict, fields, replace
from numbers import Real
from typing import Any, ClassVar

import numpy as np
from highway_env.envs.common.abstract import AbstractEnv

from lgmd_gym.aliases import Arguments, Config, Info, Values
from lgmd_gym.envs.dynamics.brake import BrakeParams
from lgmd_gym.errors import (
    check_finite,
    check_flag,
    check_items,
    check_keys,
    check_known,
    check_mapping,
    check_text,
    check_type,
    check_whole,
    check_within,
    is_number,
    shown,
)

_NUMBERS = {
    "simulation_frequency": (1e-3, 1e5, "Hz"),
    "policy_frequency": (1e-3, 1e5, "Hz"),
    "scaling": (1e-3, 1e3, "px/m"),
    "duration": (0.0, 1e6, "s"),
}
_WHOLE = {
    "screen_width": (1, 16384),
    "screen_height": (1, 16384),
    "lanes_count": (1, 100),
    "vehicles_count": (0, 1000),
}
_PAIRS = ("centering_position",)
_BRAKE_KEYS = frozenset(field.name for field in fields(BrakeParams))


class EgoBrakeEnv(AbstractEnv):
    """A highway-env environment with a strictly checked configuration and `BrakeParams` for the ego.

    Attributes:
        brake: Response of the ego to demands in the present episode; that of the configuration unless the
            episode brings its own.
    """

    _given_brake_keys: frozenset[str] = frozenset()  # fields of `BrakeParams` in the configurations so far

    # highway-env writes render_fps into this dict, hence the copy for each instance.
    metadata: ClassVar[Values] = {"render_modes": ["human", "rgb_array"]}

    def __init__(self, config: Config | None = None, render_mode: str | None = None) -> None:
        if render_mode is not None:
            check_known("render mode", render_mode, type(self).metadata["render_modes"])
        self.metadata = {**type(self).metadata}  # type: ignore[misc]
        super().__init__(config=config, render_mode=render_mode)  # type: ignore[arg-type]

    def update_metadata(self, video_real_time_ratio: int = 1) -> None:
        """Set `render_fps` so that videos play in real time."""
        super().update_metadata(video_real_time_ratio)

    @classmethod
    def default_config(cls) -> Config:
        """Return the default configuration."""
        return super().default_config() | {"policy_frequency": 30, **asdict(BrakeParams())}

    def reset(self, *, seed: int | None = None, options: Arguments | None = None) -> tuple[Any, Info]:
        """Begin an episode; if ``options["config"]`` is refused, the environment stays as it was.

        Args:
            seed: Seed of the environment's random generator; None to continue with the present one.
            options: None, or ``config``, configuration keys that apply from this episode on.

        Raises:
            ValueError: If a configuration key is unknown or a value is out of range.
        """
        check_keys("option", check_mapping("options", options), ("config",))
        seed = None if seed is None else check_whole("seed", seed, 0)
        with self._unchanged_if_refused():
            return super().reset(seed=seed, options=options)

    def configure(self, config: Config | None) -> None:
        """Apply a configuration; a refused one leaves the environment unchanged.

        Raises:
            ValueError: If a key is unknown or a value is out of range.
        """
        config = check_mapping("config", config)
        check_keys("config key", config, self.config)
        for key, value in config.items():
            config[key] = _checked_like(key, value, self.config[key])
        with self._unchanged_if_refused():
            super().configure(config)
            self._given_brake_keys |= _BRAKE_KEYS & config.keys()
            self.brake = self.episode_brake(None)
            simulation, policy = self.config["simulation_frequency"], self.config["policy_frequency"]
            if simulation % policy:
                raise ValueError(
                    f"policy_frequency {policy} Hz does not divide simulation_frequency {simulation} Hz; "
                    f"choose a divisor, for example {simulation} or {simulation / 2:g} Hz"
                )

    def episode_brake(self, drawn: BrakeParams | None) -> BrakeParams:
        """Return the brake of an episode.

        Args:
            drawn: Brake that the source of episodes has drawn; None for that of the configuration. Keys given
                in the configuration take precedence over it.
        """
        keys = _BRAKE_KEYS if drawn is None else self._given_brake_keys
        return replace(drawn or BrakeParams(), **{key: self.config[key] for key in keys})

    @contextmanager
    def _unchanged_if_refused(self) -> Generator[None, None, None]:
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


def _checked_like(key: str, value: object, present: object) -> object:
    """Return a value of the configuration; raise ValueError unless it is of the kind of the present one."""
    if key in _WHOLE:
        check_whole(key, value, *_WHOLE[key])
    elif key in _NUMBERS:
        check_within(key, value, *_NUMBERS[key])
    elif isinstance(present, bool | str | dict):
        _check_kind(key, value, present)
    elif is_number(present):
        check_finite(key, value)
    elif key in _PAIRS and len(check_items(key, value, Real, "two numbers")) != 2:
        raise ValueError(f"{key} must be a list of two numbers, got {shown(value)}")
    return value.item() if isinstance(value, np.generic) else value


def _check_kind(key: str, value: object, present: bool | str | Values) -> None:
    if isinstance(present, bool):
        check_flag(key, value)
    elif isinstance(present, str):
        check_text(key, value)
    else:
        check_type(key, value, dict)

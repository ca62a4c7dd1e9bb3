"""`RandomBrakingEnv`: a new scenario at every reset, out of a split of numbered levels."""

from collections.abc import Sequence
from typing import Any

from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.scenarios.distribution import (
    CONDITIONS,
    LEVELS,
    check_levels,
    draw_scenario,
    draw_view,
    level_generator,
)


class RandomBrakingEnv(BrakingEnv):
    """A braking environment whose scenario is drawn at every reset.

    ## Description

    Half of the levels are threats (CCRs, CCRm, CCRb, CCCscp), the others driving in which braking is the
    fault (all other families); speed, gap, offset, side and shade are drawn with them, and for the eye a
    condition (night, fog, …) and how grainy the ground is. A level number fixes everything, in any process.
    Resets without a seed draw levels of the split only, so that training never sees a level of validation
    or test; `info["level"]` and `info["condition"]` tell what was drawn.

    ## Arguments

    Args:
        split: "train", "validation" or "test": a million levels each.
        start_level: First level in use.
        num_levels: How many from there on; 0 for all that are left.
        conditions: Camera conditions to draw from, each as likely: "clear", "night", "fog", "degraded".
        config: See `BrakingEnv`.
        render_mode: See `BrakingEnv`.

    Raises:
        ValueError: For an unknown split or condition, or levels beyond the split.
    """

    def __init__(
        self,
        split: str = "train",
        start_level: int = 0,
        num_levels: int = 0,
        conditions: Sequence[str] = CONDITIONS,
        config: dict[str, Any] | None = None,
        render_mode: str | None = None,
    ) -> None:
        check_levels(split, start_level, num_levels, conditions)
        self.split, self.start_level, self.conditions = split, start_level, tuple(conditions)
        self.num_levels = num_levels or LEVELS - start_level
        self.level = start_level
        first = draw_scenario(level_generator(split, start_level))
        super().__init__(first, config=config, render_mode=render_mode)

    def _reset(self) -> None:
        """Draw a level and build its scene."""
        self.level = self.start_level + int(self.np_random.integers(self.num_levels))
        rng = level_generator(self.split, self.level)
        self.scenario = draw_scenario(rng)
        self.camera_fields = draw_view(self.split, self.level, self.conditions)
        self._build(rng)

    def _info(self, obs: Any, action: Any = None) -> dict[str, Any]:
        return super()._info(obs, action) | {
            "level": self.level,
            "condition": self.camera_fields["condition"],
        }

"""`RandomBrakingEnv`: a random scenario at every reset, from numbered levels."""

from collections.abc import Sequence
from typing import Any

from lgmd_gym.camera import CONDITIONS
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.episode_source import RandomLevels


class RandomBrakingEnv(BrakingEnv):
    """A braking environment that draws a random scenario at every reset.

    ## Description

    A level is a random scenario with a number. Half of the levels are threats (CCRs, CCRm, CCRb, CCCscp),
    half are non-threats (all other families). A level fixes the family and its arguments, the grey levels,
    the camera condition (night, fog, …) and the contrast of the road texture, in every process. The splits
    are disjoint: training never uses a level of validation or test. The environment's seed selects the
    levels; `info` adds `level` (the number) and `condition` (the camera condition).

    ## Arguments

    Args:
        split: Set of levels: "train", "validation" or "test", with 1,000,000 levels each.
        start_level: First level in use.
        num_levels: Number of levels in use; 0 for all from `start_level` on.
        conditions: Camera conditions, drawn with equal probability: "clear", "night", "fog", "degraded".
        config: See `BrakingEnv`.
        render_mode: See `BrakingEnv`.

    Raises:
        ValueError: If the split or a condition is unknown, or levels are outside the split.
    """

    def __init__(
        self,
        split: str = "train",
        start_level: int = 0,
        num_levels: int = 0,
        conditions: Sequence[str] = tuple(CONDITIONS),
        config: dict[str, Any] | None = None,
        render_mode: str | None = None,
    ) -> None:
        super().__init__(RandomLevels(split, start_level, num_levels, conditions), config, render_mode)

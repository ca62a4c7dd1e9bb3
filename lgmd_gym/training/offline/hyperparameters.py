"""How learning from recorded drives goes: the hyperparameters of "recorded"."""

from dataclasses import dataclass, field
from typing import Any

from lgmd_gym.agents.options import positive, whole
from lgmd_gym.envs.dynamics.units import check_within
from lgmd_gym.errors import check_keys


@dataclass(frozen=True)
class Recipe:
    """How it is learnt.

    Attributes:
        n_epochs: Passes over all drives.
        batch_size: Drives of one step.
        learning_rate: Highest of the one-cycle schedule (Smith & Topin 2018).
        weight_decay: Of AdamW.
        false_cost: How many times what it costs braking in a drive without a threat costs while learning.
            Few drives are of the kinds that tempt to brake, and 2 keeps it from trying its luck.
        first_chance: Chance of braking at a decision before anything is learnt.
        logit_decay: What certainty costs: weight of the squared log odds of braking, summed over a drive's
            decisions. Without it a slow learner, such as a network on frames, is soon sure never to brake,
            and then learns nothing more.
        policy_kwargs: Of stable-baselines3's policy.
    """

    n_epochs: int = 100
    batch_size: int = 64
    learning_rate: float = 0.006
    weight_decay: float = 0.01
    false_cost: float = 2.0
    first_chance: float = 0.03
    logit_decay: float = 0.0
    policy_kwargs: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("n_epochs", "batch_size"):
            whole(name, getattr(self, name), 1)
        for name in ("learning_rate", "false_cost"):
            positive(name, getattr(self, name))
        check_within("logit_decay", self.logit_decay, 0.0, 1.0)
        check_within("first_chance", self.first_chance, 1e-6, 0.999)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> "Recipe":
        """Return a recipe from plain values; unknown keys are refused."""
        check_keys("hyperparameter of recorded", values, cls.__dataclass_fields__)
        return cls(**values)

"""Learning when to brake from recorded drives: the expected return itself is followed uphill.

With a brake that latches, a policy is a chance p_t of braking at each decision of a drive, and the return of
every choice is on record. So the expected return of a drive is a sum over its decisions,

    J = Σ_t s_t (p_t B_t + (1 - p_t) r_t),  s_t = Π_{u<t} (1 - p_u),

of what braking there returns (B) and what holding the speed earns until the next (r): nothing is sampled,
and nothing estimated by a second network. In expectation over episodes this is what REINFORCE (Williams
1992) samples.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import torch
from torch.nn.functional import logsigmoid

from lgmd_gym.agents.base import HOLD
from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.training.config import Plan
from lgmd_gym.training.offline.dataset import Batch, Lessons
from lgmd_gym.training.offline.episodes import Drive
from lgmd_gym.training.offline.hyperparameters import Recipe

JUDGED_AT_ONCE = 64  # drives


class Look(NamedTuple):
    """How a policy does without chance, braking where its chance is above one half.

    Attributes:
        ret: Mean return, of levels and pieces of traffic alike.
        avoided: Share of threats that end without contact.
        false: Share of levels without a threat in which it brakes.
        traffic: Share of pieces of traffic in which it brakes; NaN without any.
    """

    ret: float
    avoided: float
    false: float
    traffic: float


class Learner:
    """A stable-baselines3 policy that learns from recorded drives.

    Args:
        plan: Of the training.
        drives: To learn from.
        judges: To look at after every pass.
        pieces: How many of these, at their end, are pieces of traffic.
    """

    def __init__(self, plan: Plan, drives: list[Drive], judges: list[Drive], pieces: int = 0) -> None:
        self.plan, self.recipe = plan, Recipe.from_dict(plan.model)
        features = FeatureConfig.from_dict(plan.features)
        self.lessons, self.judges = Lessons(drives, features), Lessons(judges, features)
        self.model = self._untaught()
        self._levels = len(judges) - pieces
        self.best = Look(-np.inf, 0.0, 0.0, 0.0)

    def _untaught(self) -> Any:
        from stable_baselines3 import PPO

        torch.set_num_threads(1)
        env = self.plan.make_env("train")
        # PPO gives the network and the file; its own learning is not used, nor is its critic.
        kwargs = {"activation_fn": torch.nn.ReLU, "net_arch": {"pi": [64, 64], "vf": []}}
        kwargs |= self.recipe.policy_kwargs
        model = PPO(
            self.plan.policy, env, 2e-3, 2, 2, seed=self.plan.seed, device="cpu", policy_kwargs=kwargs
        )
        env.close()
        hold, brake = self._actions
        odds = self.recipe.first_chance / (1.0 - self.recipe.first_chance)
        bias: Any = model.policy.action_net.bias
        with torch.no_grad():
            bias[brake], bias[hold] = float(np.log(odds)), 0.0
        return model

    @property
    def _actions(self) -> tuple[int, int]:
        demands = self.plan.demands
        return demands.index(HOLD), demands.index(min(demands))

    def learn(self, log: Callable[[int, dict[str, float]], None]) -> Any:
        """Learn to the end and return the model as it did best on `judges`.

        Args:
            log: Called after each pass with its number and what was reached.
        """
        recipe, policy = self.recipe, self.model.policy
        taught = [p for name, p in policy.named_parameters() if "value" not in name]
        steps = -(-len(self.lessons) // recipe.batch_size)
        optimizer = torch.optim.AdamW(taught, recipe.learning_rate, weight_decay=recipe.weight_decay)
        schedule = torch.optim.lr_scheduler.OneCycleLR(
            optimizer, recipe.learning_rate, total_steps=recipe.n_epochs * steps
        )
        rng = np.random.default_rng(self.plan.seed)
        best = {name: value.clone() for name, value in policy.state_dict().items()}
        for number in range(1, recipe.n_epochs + 1):
            policy.set_training_mode(True)
            gained = 0.0
            for chosen in np.array_split(rng.permutation(len(self.lessons)), steps):
                batch = dearer(self.lessons.batch(chosen), recipe.false_cost)
                logits = self.logits(batch)
                value = expected_return(logits, batch).mean()
                certainty = (logits * batch.valid).square().sum(1).mean()
                optimizer.zero_grad()
                (-0.1 * (value - recipe.logit_decay * certainty)).backward()
                torch.nn.utils.clip_grad_norm_(taught, 1.0)
                optimizer.step()
                schedule.step()
                gained += float(value.detach()) * len(chosen) / len(self.lessons)
            look = self.look()
            if look.ret > self.best.ret:
                self.best = look
                best = {name: value.clone() for name, value in policy.state_dict().items()}
            told = {name: value for name, value in look._asdict().items() if value == value}  # no NaN
            log(number, {"train": gained, **told, "best": self.best.ret})
        policy.load_state_dict(best)
        return self.model

    def logits(self, batch: Batch) -> torch.Tensor:
        """Return the log odds of braking at each decision, (N, T)."""
        told = self.model.policy.get_distribution(batch.shown).distribution.logits
        hold, brake = self._actions
        table = torch.zeros_like(batch.valid)
        table[batch.place] = told[:, brake] - told[:, hold]
        return table

    def look(self) -> Look:
        """Return how the policy does on `judges` without chance."""
        self.model.policy.set_training_mode(False)
        parts = [
            self._ends(self.judges.batch(range(start, min(start + JUDGED_AT_ONCE, len(self.judges)))))
            for start in range(0, len(self.judges), JUDGED_AT_ONCE)
        ]
        returns, brakes, contacts, threats = (torch.cat(item).numpy() for item in zip(*parts, strict=True))
        level = np.arange(len(threats)) < self._levels
        return Look(
            float(returns.mean()),
            _share(~contacts[threats]),
            _share(brakes[level & ~threats]),
            _share(brakes[~level]),
        )

    @torch.no_grad()
    def _ends(self, batch: Batch) -> tuple[torch.Tensor, ...]:
        """Tell of each drive its return, and whether it brakes, ends in a contact, and is a threat."""
        wants = (self.logits(batch) > 0.0) & (batch.valid > 0.0)
        brakes = wants.any(1)
        so_far = torch.cumsum(wants, 1)
        before, first = so_far == 0, wants & (so_far == 1)
        returns = (batch.rewards * before).sum(1) + (batch.returns * first).sum(1)
        contacts = torch.where(brakes, (batch.contacts & first).any(1), batch.threats)
        return returns, brakes, contacts, batch.threats


def dearer(batch: Batch, false_cost: float) -> Batch:
    """Return a batch in which braking without a threat costs so many times what it does."""
    left = torch.flip(torch.cumsum(torch.flip(batch.rewards, [1]), 1), [1])  # of holding to the end
    dear = left + false_cost * (batch.returns - left)
    quiet = ~batch.threats[:, None] & (batch.valid > 0.0)
    return batch._replace(returns=torch.where(quiet, dear, batch.returns))


def expected_return(logits: torch.Tensor, batch: Batch) -> torch.Tensor:
    """Return the expected return of each drive, (N,), given the log odds of braking, (N, T)."""
    brake = logsigmoid(logits)
    hold = logsigmoid(-logits) * batch.valid
    arrives = torch.cumsum(hold, 1) - hold
    return (torch.exp(arrives + brake) * batch.returns + torch.exp(arrives + hold) * batch.rewards).sum(1)


def _share(held: np.ndarray) -> float:
    return float(held.mean()) if len(held) else float("nan")

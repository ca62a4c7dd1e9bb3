"""What is to be trained: a user's order, and the plan that it comes to with everything filled in."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym

from lgmd_gym.agents import HOLD, make_agent
from lgmd_gym.agents.options import whole
from lgmd_gym.agents.policies.features import FRAME, LATCH_DEMAND, FeatureConfig
from lgmd_gym.envs.dynamics.units import check_within
from lgmd_gym.training.hyperparameters import RECORDED, read_settings
from lgmd_gym.training.offline.hyperparameters import Recipe
from lgmd_gym.training.policy_wrapper import PolicyView

RANDOM_ID = "LGMD/RandomBraking-v0"
DEMANDS = (0.0, -0.4, -1.0)
CAMERAS = ("fovea", "tele", "wide")
SEEDS_APART = 1_000_000  # between what neighbouring trainings reset their environments with
JUDGED = 10_000  # from which the validation split is reset for a look


@dataclass(frozen=True)
class Plan:
    """A training with nothing left open: plain values, as in a training's folder and a policy's card.

    Attributes:
        algo: "ppo", "sac", "dqn" or "recorded".
        env_id: The environment; those of a split are trained on "train" and judged on "validation".
        env_kwargs: Further arguments of `gym.make`.
        camera: See `LGMDObservation`.
        demands: Demands the policy chooses among; none for any.
        features: Arguments of `PolicyView`.
        n_envs: Environments side by side.
        n_timesteps: Decisions of the policy, over all environments; of "recorded", drives.
        policy: stable-baselines3's name of the network.
        model: Further arguments of the algorithm, as in the YAML file; of "recorded", of `Recipe`.
        seed: Of the network and the environments.
        eval_every: Decisions between two looks at the validation split; "recorded" looks after every pass.
        eval_episodes: Episodes of a look.
        drives: Folder of a training of "recorded" whose drives are learnt from; None to record them.
        traffic: Drives through traffic that "recorded" learns from beside the levels; for the looks, a
            quarter as many.
    """

    algo: str
    env_id: str
    env_kwargs: dict[str, Any]
    camera: Any
    demands: list[float]
    features: dict[str, Any]
    n_envs: int
    n_timesteps: int
    policy: str
    model: dict[str, Any]
    seed: int
    eval_every: int
    eval_episodes: int
    drives: str | None = None
    traffic: int = 0

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return asdict(self)

    def make_env(self, split: str) -> PolicyView:
        """Return one environment as the policy sees it, of a split if it has splits."""
        # Looks are told in the environment's own returns.
        features = self.features if split == "train" else {**self.features, "reward_scale": 1.0}
        return PolicyView(self.make_plain(split), **features)

    def make_plain(self, split: str) -> gym.Env:
        """Return one environment inside `LGMDObservation`, of a split if it has splits."""
        arguments = dict(self.env_kwargs)
        if self.env_id == RANDOM_ID:
            arguments.setdefault("split", split)
        if self.demands:
            levels = {"type": "DiscreteDemand", "levels": self.demands}
            arguments["config"] = {**(arguments.get("config") or {}), "action": levels}
        if FRAME in self.features["inputs"]:
            arguments["include_frame"] = True
        return gym.make(self.env_id, camera=self.camera, **arguments)


@dataclass(frozen=True)
class Order:
    """What a user wants trained; what it leaves open is filled in by hyperparameters and defaults.

    Attributes:
        algo: "ppo", "sac", "dqn" or "recorded".
        env_id: The environment; those of a split are trained on "train" and judged on "validation".
        camera: Camera presets; empty for "fovea", "tele" and "wide".
        eye: Name of an agent whose own eye is used, such as "stopping-zone"; None for `camera`.
        steps: Decisions of the policy, of "recorded" drives; None for what the hyperparameters say.
        seed: Of the network and the environments.
        hyperparams: YAML file in rl-zoo's format; None for the package's.
        inputs: What the policy sees, see `FeatureConfig`; empty for what the hyperparameters say.
        demands: Demands the policy chooses among, in [-1, 1]; empty for any, which DQN cannot; None for 0,
            -0.4 and -1, of "recorded" 0 and -1.
        eval_every: Decisions between two looks at the validation split; "recorded" looks after every pass.
        eval_episodes: Episodes of a look; None for 60, of "recorded" 600.
        drives: Folder of a training of "recorded" whose drives are learnt from; None to record them.
        traffic: Drives through traffic that "recorded" learns from beside the levels.
        env_kwargs: Further arguments of `gym.make`.
    """

    algo: str = "sac"
    env_id: str = RANDOM_ID
    camera: Sequence[str] = ()
    eye: str | None = None
    steps: int | None = None
    seed: int = 0
    hyperparams: Path | None = None
    inputs: Sequence[str] = ()
    demands: Sequence[float] | None = None
    eval_every: int = 20_000
    eval_episodes: int | None = None
    drives: Path | None = None
    traffic: int = 0
    env_kwargs: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        recorded = self.algo == RECORDED
        if self.demands is None:
            object.__setattr__(self, "demands", (0.0, -1.0) if recorded else DEMANDS)
        if self.algo == "dqn" and not self.demands:
            raise ValueError("dqn chooses among demands: give some, as --demands 0 -1")
        for name in ("steps", "eval_every", "eval_episodes"):
            if getattr(self, name) is not None:
                whole(name, getattr(self, name), 1)
        for demand in self.demands or ():
            check_within("demands", demand, -1.0, 1.0)
        if recorded and (sorted(self.demands or ())[1:] != [HOLD] or min(self.demands or ()) > LATCH_DEMAND):
            raise ValueError(
                f"recorded learns when to brake: demands must be 0 and {LATCH_DEMAND} or less, as 0 -1"
            )
        if self.drives is not None and not recorded:
            raise ValueError(f"drives are what algo 'recorded' learns from; {self.algo} drives itself")
        whole("traffic", self.traffic, 0)
        if self.traffic and not recorded:
            raise ValueError(f"only algo 'recorded' learns from traffic; leave it out with {self.algo!r}")
        if self.eye is not None and self.camera:
            raise ValueError(f"give either camera or eye, got {list(self.camera)} and {self.eye!r}")

    def plan(self) -> Plan:
        """Return the order with everything filled in.

        Raises:
            ValueError: For unknown names, unreadable hyperparameters, or an agent without an eye of its own.
        """
        settings = read_settings(self.algo, self.env_id, self.hyperparams)
        wished = {"inputs": list(self.inputs)} if self.inputs else {}
        features = FeatureConfig.from_dict(settings.features | wished)
        if self.algo == RECORDED:
            Recipe.from_dict(settings.model)
            _check_recordable(features)
        return Plan(
            algo=self.algo,
            env_id=self.env_id,
            env_kwargs=dict(self.env_kwargs),
            camera=self._lenses(),
            demands=[] if self.algo == "sac" else list(self.demands or ()),  # SAC knows no choice
            features=features.to_dict(),
            n_envs=settings.n_envs,
            n_timesteps=settings.n_timesteps if self.steps is None else self.steps,
            policy=settings.policy,
            model=settings.model,
            seed=self.seed,
            eval_every=self.eval_every,
            eval_episodes=self.eval_episodes or (600 if self.algo == RECORDED else 60),
            drives=None if self.drives is None else str(self.drives),
            traffic=self.traffic,
        )

    def _lenses(self) -> Any:
        if self.eye is None:
            lenses = list(self.camera or CAMERAS)
            return lenses if len(lenses) > 1 else lenses[0]
        camera = make_agent(self.eye).camera
        if camera is None:
            raise ValueError(f"agent {self.eye!r} has no eye of its own; use camera, or eye 'stopping-zone'")
        return camera


def _check_recordable(features: FeatureConfig) -> None:
    if not features.latch:
        raise ValueError("recorded learns when to brake: its hyperparameters need latch: true")
    if "speed_change" in features.inputs:
        # A policy that had it braked in traffic whenever the driver sped up.
        raise ValueError(
            "nobody speeds up on recorded levels, so that 'speed_change' teaches little and misleads "
            "wherever somebody does; leave it out of the inputs"
        )

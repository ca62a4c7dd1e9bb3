"""What is to be trained: a user's order, and the plan that it comes to with everything filled in."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.features import FRAME, Features
from lgmd_gym.envs.units import check_within
from lgmd_gym.training.settings import read_settings
from lgmd_gym.training.view import PolicyView

RANDOM_ID = "LGMD/RandomBraking-v0"
DEMANDS = (0.0, -0.4, -1.0)
CAMERAS = ("fovea", "tele", "wide")


@dataclass(frozen=True)
class Plan:
    """A training with nothing left open: plain values, as in a training's folder and a policy's card.

    Attributes:
        algo: "ppo", "sac" or "dqn".
        env_id: The environment; those of a split are trained on "train" and judged on "validation".
        env_kwargs: Further arguments of `gym.make`.
        camera: See `LGMDObservation`.
        demands: Demands the policy chooses among; none for any.
        features: Arguments of `PolicyView`.
        n_envs: Environments side by side.
        n_timesteps: Decisions of the policy, over all environments.
        policy: stable-baselines3's name of the network.
        model: Further arguments of the algorithm, as in the YAML file.
        seed: Of the network and the environments.
        eval_every: Decisions between two looks at the validation split.
        eval_episodes: Episodes of a look.
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

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return asdict(self)

    def make_env(self, split: str) -> gym.Env:
        """Return one environment as the policy sees it, of a split if it has splits."""
        arguments = dict(self.env_kwargs)
        if self.env_id == RANDOM_ID:
            arguments.setdefault("split", split)
        if self.demands:
            levels = {"type": "DiscreteDemand", "levels": self.demands}
            arguments["config"] = {**(arguments.get("config") or {}), "action": levels}
        if FRAME in self.features["inputs"]:
            arguments["include_frame"] = True
        # Looks are told in the environment's own returns.
        features = self.features if split == "train" else {**self.features, "reward_scale": 1.0}
        return PolicyView(gym.make(self.env_id, camera=self.camera, **arguments), **features)


@dataclass(frozen=True)
class Order:
    """What a user wants trained; what it leaves open is filled in by hyperparameters and defaults.

    Attributes:
        algo: "ppo", "sac" or "dqn".
        env_id: The environment; those of a split are trained on "train" and judged on "validation".
        camera: Camera presets; empty for "fovea", "tele" and "wide".
        eye: Name of an agent whose own eye is used, such as "stopping-zone"; None for `camera`.
        steps: Decisions of the policy; None for what the hyperparameters say.
        seed: Of the network and the environments.
        hyperparams: YAML file in rl-zoo's format; None for the package's.
        inputs: What the policy sees, see `Features`; empty for what the hyperparameters say.
        demands: Demands the policy chooses among, in [-1, 1]; empty for any, which DQN cannot.
        eval_every: Decisions between two looks at the validation split.
        eval_episodes: Episodes of a look.
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
    demands: Sequence[float] = DEMANDS
    eval_every: int = 20_000
    eval_episodes: int = 60
    env_kwargs: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.algo == "dqn" and not self.demands:
            raise ValueError("dqn chooses among demands: give some, as --demands 0 -1")
        for demand in self.demands:
            check_within("demands", demand, -1.0, 1.0)
        if self.eye is not None and self.camera:
            raise ValueError(f"give either camera or eye, got {list(self.camera)} and {self.eye!r}")

    def plan(self) -> Plan:
        """Return the order with everything filled in.

        Raises:
            ValueError: For unknown names, unreadable hyperparameters, or an agent without an eye of its own.
        """
        settings = read_settings(self.algo, self.env_id, self.hyperparams)
        wished = {"inputs": list(self.inputs)} if self.inputs else {}
        return Plan(
            algo=self.algo,
            env_id=self.env_id,
            env_kwargs=dict(self.env_kwargs),
            camera=self._lenses(),
            demands=[] if self.algo == "sac" else list(self.demands),  # SAC knows no choice
            features=Features.from_dict(settings.features | wished).to_dict(),
            n_envs=settings.n_envs,
            n_timesteps=self.steps or settings.n_timesteps,
            policy=settings.policy,
            model=settings.model,
            seed=self.seed,
            eval_every=self.eval_every,
            eval_episodes=self.eval_episodes,
        )

    def _lenses(self) -> Any:
        if self.eye is None:
            lenses = list(self.camera or CAMERAS)
            return lenses if len(lenses) > 1 else lenses[0]
        camera = make_agent(self.eye).camera
        if camera is None:
            raise ValueError(f"agent {self.eye!r} has no eye of its own; use camera, or eye 'stopping-zone'")
        return camera

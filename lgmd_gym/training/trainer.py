"""One training: environments, model, callbacks, and the policy file that comes out."""

import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym

import lgmd_gym
from lgmd_gym.agents import make_agent
from lgmd_gym.agents.features import FRAME, Features
from lgmd_gym.agents.policy import write_card
from lgmd_gym.envs.units import check_within
from lgmd_gym.folders import new_folder
from lgmd_gym.training.settings import Settings, read_settings
from lgmd_gym.training.view import PolicyView

RANDOM_ID = "LGMD/RandomBraking-v0"
DEMANDS = (0.0, -0.4, -1.0)
JUDGED = 10_000  # seed of the levels that a look at the validation split plays
CAMERAS = ("fovea", "tele", "wide")
# Of a saved model: where it logged, and the episodes it was in.
TRAINING_ONLY = (
    "tensorboard_log",
    "ep_info_buffer",
    "ep_success_buffer",
    "_last_obs",
    "_last_original_obs",
    "_last_episode_starts",
)


@dataclass(frozen=True)
class Order:
    """What is to be trained.

    Attributes:
        algo: "ppo", "sac" or "dqn".
        env_id: The environment; those of a split are trained on "train" and judged on "validation".
        camera: See `LGMDObservation`.
        eye: Name of an agent whose own eye takes the camera's place, such as "stopping-zone".
        steps: Decisions of the policy; None for what the hyperparameters say.
        seed: Of the network and the environments.
        hyperparams: YAML file in rl-zoo's format; None for the package's.
        inputs: Observation keys the policy sees; empty for what the hyperparameters say.
        demands: Demands the policy chooses among, in [-1, 1]; empty for any, which DQN cannot.
        eval_every: Decisions between two looks at the validation split.
        eval_episodes: Episodes of a look.
        env_kwargs: Further arguments of `gym.make`.
    """

    algo: str = "sac"
    env_id: str = RANDOM_ID
    camera: Sequence[str] = CAMERAS
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
        if self.algo == "sac" and self.demands:
            object.__setattr__(self, "demands", ())  # knows no choice
        for demand in self.demands:
            check_within("demands", demand, -1.0, 1.0)

    def settings(self) -> Settings:
        """Return the hyperparameters, with this order's own wishes laid over them."""
        found = read_settings(self.algo, self.env_id, self.hyperparams)
        features = found.features | ({"inputs": list(self.inputs)} if self.inputs else {})
        return found._replace(features=features, n_timesteps=self.steps or found.n_timesteps)

    def lenses(self) -> Any:
        """Return what the policy looks through, as `LGMDObservation` takes it.

        Raises:
            ValueError: For an agent without an eye of its own.
        """
        if self.eye is None:
            return list(self.camera) if len(self.camera) > 1 else self.camera[0]
        camera = make_agent(self.eye).camera
        if camera is None:
            raise ValueError(f"agent {self.eye!r} has no eye of its own; use camera, or eye 'stopping-zone'")
        return camera

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        hyperparams = None if self.hyperparams is None else str(self.hyperparams)
        return asdict(self) | {
            "hyperparams": hyperparams,
            "camera": list(self.camera),
            "inputs": list(self.inputs),
        }

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> "Order":
        """Return the order that `to_dict` was called on."""
        file = values["hyperparams"]
        return cls(
            **values
            | {
                "camera": tuple(values["camera"]),
                "inputs": tuple(values["inputs"]),
                "demands": tuple(values["demands"]),
                "hyperparams": None if file is None else Path(file),
            }
        )


def make_env(order: Order, features: dict[str, Any], split: str) -> gym.Env:
    """Return one environment as the policy sees it."""
    arguments = dict(order.env_kwargs)
    if order.env_id == RANDOM_ID:
        arguments.setdefault("split", split)
    if order.demands:
        levels = {"type": "DiscreteDemand", "levels": list(order.demands)}
        arguments["config"] = {**(arguments.get("config") or {}), "action": levels}
    if FRAME in Features.from_dict(features).inputs:
        arguments["include_frame"] = True
    if split != "train":
        features = {**features, "reward_scale": 1.0}  # looks are told in the environment's own returns
    return PolicyView(gym.make(order.env_id, camera=order.lenses(), **arguments), **features)


class Training:
    """One training into a folder, new or resumed.

    Args:
        order: What is trained.
        folder: Where; made by `start`, read by `resume`.
    """

    def __init__(self, order: Order, folder: Path) -> None:
        self.order, self.folder = order, folder
        self.settings = order.settings()

    @classmethod
    def start(cls, order: Order, folder: Path) -> "Training":
        """Begin a new one.

        Raises:
            ValueError: For anything in the order that cannot be, or a folder that exists or cannot be made;
                before anything is trained.
        """
        training = cls(order, folder)
        make_env(order, training.settings.features, "train").close()
        new_folder(folder, "training folder")
        (folder / "order.json").write_text(json.dumps(order.to_dict(), indent=2) + "\n", encoding="utf-8")
        return training

    @classmethod
    def resume(cls, folder: Path) -> "Training":
        """Go on with one that was broken off, from its last checkpoint.

        Raises:
            ValueError: If the folder holds no training.
        """
        try:
            order = json.loads((folder / "order.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            raise ValueError(f"{str(folder)!r} holds no training to resume (no order.json)") from None
        return cls(Order.from_dict(order), folder)

    @property
    def policy(self) -> Path:
        """The policy file that comes out."""
        return self.folder / "policy.zip"

    def run(self, progress: bool = False) -> Path:
        """Train to the end and return the policy file: the model that did best on the validation split."""
        from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

        features = self.settings.features
        envs = VecMonitor(
            DummyVecEnv([lambda: make_env(self.order, features, "train")] * self.settings.n_envs)
        )
        judges = VecMonitor(DummyVecEnv([lambda: make_env(self.order, features, "validation")]))
        envs.seed(self.order.seed)
        started = time.perf_counter()
        try:
            model = self._model(envs)
            left = self.settings.n_timesteps - model.num_timesteps
            if left > 0:
                model.learn(
                    left,
                    self._callbacks(judges),
                    reset_num_timesteps=False,
                    progress_bar=progress,
                    tb_log_name="log",
                )
            model.save(self.folder / "last.zip")
        finally:
            envs.close()
            judges.close()
        return self._finish(time.perf_counter() - started)

    def _model(self, envs: Any) -> Any:
        import stable_baselines3
        import torch

        torch.set_num_threads(1)
        algorithm = getattr(stable_baselines3, self.order.algo.upper())
        newest = self._newest_checkpoint()
        if newest is not None:
            model = algorithm.load(newest, envs, device="cpu")
            buffer = newest.with_name(newest.name.replace("model_", "model_replay_buffer_")).with_suffix(
                ".pkl"
            )
            if buffer.exists():
                model.load_replay_buffer(buffer)
            return model
        return algorithm(
            self.settings.policy,
            envs,
            seed=self.order.seed,
            device="cpu",
            tensorboard_log=str(self.folder / "tensorboard"),
            **self.settings.model,
        )

    def _newest_checkpoint(self) -> Path | None:
        found = self.folder.glob("checkpoints/model_*_steps.zip")
        return max(found, key=lambda path: int(path.stem.split("_")[-2]), default=None)

    def _callbacks(self, judges: Any) -> list[Any]:
        from stable_baselines3.common.callbacks import CheckpointCallback, EvalCallback

        class SameLevels(EvalCallback):
            """Judges on the same levels at every look, so that two looks can be compared."""

            def _on_step(self) -> bool:
                if self.eval_freq > 0 and self.n_calls % self.eval_freq == 0:
                    self.eval_env.seed(JUDGED)
                return super()._on_step()

        every = max(self.order.eval_every // self.settings.n_envs, 1)
        return [
            CheckpointCallback(
                every, str(self.folder / "checkpoints"), "model", save_replay_buffer=self.order.algo != "ppo"
            ),
            SameLevels(
                judges,
                eval_freq=every,
                n_eval_episodes=self.order.eval_episodes,
                best_model_save_path=str(self.folder / "best"),
                log_path=str(self.folder / "best"),
                verbose=0,
            ),
        ]

    def _finish(self, wall_time: float) -> Path:
        """Write the best model to `policy.zip`, with its card and without what only training needs."""
        import stable_baselines3

        best = self.folder / "best" / "best_model.zip"
        algorithm = getattr(stable_baselines3, self.order.algo.upper())
        model = algorithm.load(best if best.exists() else self.folder / "last.zip", device="cpu")
        model.save(self.policy, exclude=TRAINING_ONLY)
        write_card(self.policy, self._card(wall_time))
        return self.policy

    def _card(self, wall_time: float) -> dict[str, Any]:
        return {
            "lgmd_gym": lgmd_gym.__version__,
            "algo": self.order.algo,
            "camera": self.order.lenses(),
            "features": Features.from_dict(self.settings.features).to_dict(),
            "levels": list(self.order.demands) or None,
            "order": self.order.to_dict(),
            "steps": self.settings.n_timesteps,
            "wall_time": round(wall_time, 1),
        }

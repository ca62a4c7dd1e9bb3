"""Training with the algorithms of stable-baselines3: environments, callbacks and checkpoints."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lgmd_gym.training.config import SEED_STRIDE, VALIDATION_SEED, TrainConfig

if TYPE_CHECKING:
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.callbacks import BaseCallback, EvalCallback
    from stable_baselines3.common.vec_env import VecEnv


def train_online(config: TrainConfig, folder: Path, progress: bool) -> "BaseAlgorithm":
    """Train from the last checkpoint in the folder, if any; return the best model on the validation split."""
    import torch
    from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

    torch.set_num_threads(1)
    envs = VecMonitor(DummyVecEnv([lambda: config.make_policy_env("train")] * config.n_envs))
    eval_envs = VecMonitor(DummyVecEnv([lambda: config.make_policy_env("validation")]))
    try:
        model = _make_model(config, folder, envs)
        # The constructor seeds environment i with seed + i. Training runs with neighbouring seeds would then
        # share the levels of most environments.
        envs.seed(SEED_STRIDE * config.seed + model.num_timesteps)
        remaining = config.n_timesteps - model.num_timesteps
        if remaining > 0:
            model.learn(
                remaining,
                _callbacks(config, folder, eval_envs),
                reset_num_timesteps=False,
                progress_bar=progress,
                tb_log_name="log",
            )
        model.save(folder / "last.zip")
    finally:
        envs.close()
        eval_envs.close()
    best = folder / "best" / "best_model.zip"
    return algorithm_class(config.algo).load(best if best.exists() else folder / "last.zip", device="cpu")


def algorithm_class(algo: str) -> "type[BaseAlgorithm]":
    """Return the class of a stable-baselines3 algorithm such as "ppo"."""
    import stable_baselines3

    return getattr(stable_baselines3, algo.upper())


def _make_model(config: TrainConfig, folder: Path, envs: "VecEnv") -> Any:
    """Return the newest checkpoint in a folder, or a new model."""
    algorithm, checkpoint = algorithm_class(config.algo), newest_checkpoint(folder)
    if checkpoint is not None:
        model: Any = algorithm.load(checkpoint, envs, device="cpu")
        buffer = checkpoint.with_name(checkpoint.name.replace("model_", "model_replay_buffer_"))
        if buffer.with_suffix(".pkl").exists():
            model.load_replay_buffer(buffer.with_suffix(".pkl"))
        return model
    return algorithm(
        config.policy,
        envs,
        seed=config.seed,
        device="cpu",
        tensorboard_log=str(folder / "tensorboard"),
        **_with_schedules(config.algo_kwargs),
    )


def newest_checkpoint(folder: Path) -> Path | None:
    """Return the last checkpoint in a training folder, or None."""
    found = folder.glob("checkpoints/model_*_steps.zip")
    return max(found, key=lambda path: int(path.stem.split("_")[-2]), default=None)


def _with_schedules(algo_kwargs: dict[str, Any]) -> dict[str, Any]:
    """Return algorithm arguments with each "lin_x" replaced by a linear decay from x to 0."""
    from stable_baselines3.common.utils import LinearSchedule

    return {
        name: LinearSchedule(float(value.removeprefix("lin_")), 0.0, 1.0)
        if isinstance(value, str) and value.startswith("lin_")
        else value
        for name, value in algo_kwargs.items()
    }


def _callbacks(config: TrainConfig, folder: Path, eval_envs: "VecEnv") -> "list[BaseCallback]":
    from stable_baselines3.common.callbacks import CheckpointCallback, EvalCallback

    class SameLevelsEvalCallback(EvalCallback):
        """Evaluates on the same levels every time, so that evaluations are comparable."""

        def _on_step(self) -> bool:
            if self.eval_freq > 0 and self.n_calls % self.eval_freq == 0:
                self.eval_env.seed(VALIDATION_SEED)
            return super()._on_step()

    eval_freq = max(config.eval_freq // config.n_envs, 1)
    evaluation = SameLevelsEvalCallback(
        eval_envs,
        eval_freq=eval_freq,
        n_eval_episodes=config.eval_episodes,
        best_model_save_path=str(folder / "best"),
        log_path=str(folder / "best"),
        verbose=0,
    )
    _restore_evaluations(evaluation)
    checkpoints = CheckpointCallback(
        eval_freq, str(folder / "checkpoints"), "model", save_replay_buffer=config.algo != "ppo"
    )
    return [checkpoints, evaluation]


def _restore_evaluations(callback: "EvalCallback") -> None:
    """Load the evaluations of an interrupted run; only a better model then replaces its best one."""
    file = Path(callback.log_path or "").with_suffix(".npz")
    if file.exists():
        with np.load(file) as log:
            callback.evaluations_timesteps = log["timesteps"].tolist()
            callback.evaluations_results = log["results"].tolist()
            callback.evaluations_length = log["ep_lengths"].tolist()
            callback.best_mean_reward = float(log["results"].mean(axis=1).max())

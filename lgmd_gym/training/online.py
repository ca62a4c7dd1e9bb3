"""Training with the algorithms of stable-baselines3."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lgmd_gym.aliases import Arguments
from lgmd_gym.training.config import TrainConfig

if TYPE_CHECKING:
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.vec_env import VecEnv


def train_online(config: TrainConfig, folder: Path, progress: bool) -> "BaseAlgorithm":
    """Train from the last checkpoint in the folder, if any; return the best model on the validation split.

    Args:
        config: Configuration of the training.
        folder: Training folder.
        progress: Whether to print mean returns, with a progress bar on a terminal.
    """
    import torch

    from lgmd_gym.training.callbacks import best_model, save_model

    torch.set_num_threads(1)
    envs, eval_envs = make_envs(config, "train"), make_envs(config, "validation")
    try:
        model = _make_model(config, folder, envs)
        # The constructor seeds environment i with seed + i. Training runs with neighbouring seeds would then
        # share the levels of most environments.
        envs.seed(config.first_seed + model.num_timesteps)
        remaining = config.n_timesteps - model.num_timesteps
        if remaining > 0:
            with _callbacks(config, folder, eval_envs, model, progress) as callbacks:
                model.learn(remaining, callbacks, reset_num_timesteps=False, tb_log_name="log")
        save_model(model, folder / "last.zip")
    finally:
        envs.close()
        eval_envs.close()
    return best_model(algorithm_class(config.algo), folder)


def make_envs(config: TrainConfig, split: str) -> "VecEnv":
    """Return the environments of a training run: the engine, or single environments where it has no id."""
    import gymnasium as gym
    from joblib import cpu_count
    from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

    from lgmd_gym.training.policy_env import PolicyVecEnv

    if gym.spec(config.env_id).vector_entry_point is None:
        return VecMonitor(DummyVecEnv([lambda: config.make_policy_env(split)] * config.n_envs))
    envs: Any = gym.make_vec(
        config.env_id,
        num_envs=config.n_envs,
        threads=min(cpu_count(), config.n_envs),
        autoreset_mode="Disabled",
        **config.env_arguments(split),
    )
    return PolicyVecEnv(envs.unwrapped, config.features_of(split))


def algorithm_class(algo: str) -> "type[BaseAlgorithm]":
    """Return the class of a stable-baselines3 algorithm such as "ppo"."""
    import stable_baselines3

    return getattr(stable_baselines3, algo.upper())


def _make_model(config: TrainConfig, folder: Path, envs: "VecEnv") -> Any:
    """Return the model of the newest checkpoint that opens, or a new model."""
    from lgmd_gym.training.callbacks import load_checkpoint

    algorithm = algorithm_class(config.algo)
    model = load_checkpoint(algorithm, folder, envs)
    if model is not None:
        return model
    return algorithm(
        config.policy,
        envs,
        seed=config.seed,
        device="cpu",
        tensorboard_log=str(folder / "tensorboard"),
        **algorithm_kwargs(config),
    )


def algorithm_kwargs(config: TrainConfig) -> Arguments:
    """Return the arguments of the algorithm, each "lin_x" replaced by a linear decay from x to 0."""
    from stable_baselines3.common.utils import LinearSchedule

    return {
        name: LinearSchedule(float(value.removeprefix("lin_")), 0.0, 1.0)
        if isinstance(value, str) and value.startswith("lin_")
        else value
        for name, value in config.algo_kwargs.items()
    }


@contextmanager
def _callbacks(
    config: TrainConfig, folder: Path, eval_envs: "VecEnv", model: "BaseAlgorithm", progress: bool
) -> Generator["list[BaseCallback]", None, None]:
    from lgmd_gym.training.callbacks import CheckpointSaver, Evaluator, MonitorLog
    from lgmd_gym.training.returns import ReturnTable, progress_bar

    frequency = max(config.eval_freq // config.n_envs, 1)
    evaluator = Evaluator(eval_envs, folder, frequency, config.eval_episodes)
    evaluator.restore(model)
    saver, log = CheckpointSaver(folder, frequency), MonitorLog(folder, config.env_id)
    callbacks: list[BaseCallback] = [saver, evaluator, log]
    if not progress:
        yield callbacks
        return
    with progress_bar(config.n_timesteps) as show:
        evaluator.show = show
        yield [*callbacks, ReturnTable(config, evaluator, show)]

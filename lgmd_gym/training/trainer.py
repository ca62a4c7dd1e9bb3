"""`train` and `resume`: one training run in a folder, from its configuration to the policy file."""

import inspect
import json
import time
import warnings
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import lgmd_gym
from lgmd_gym.agents.policies.card import read_card, write_card
from lgmd_gym.agents.policies.evidence import TimeToBrakeParams
from lgmd_gym.agents.policies.network import describe_network
from lgmd_gym.agents.policies.policy import find_policy
from lgmd_gym.errors import check_keys, check_whole
from lgmd_gym.processes.files import FolderLock, complete_file, new_folder
from lgmd_gym.processes.inputs import read_json
from lgmd_gym.processes.user_modules import error_reason
from lgmd_gym.sensing.channel import plain_values
from lgmd_gym.training.config import TrainConfig
from lgmd_gym.training.hyperparams import TIME_TO_BRAKE
from lgmd_gym.training.model_card import write_model_card
from lgmd_gym.training.policy_env import PolicyWrapper

if TYPE_CHECKING:
    from stable_baselines3 import PPO

    from lgmd_gym.training.offline.time_to_brake import TimeToBrakeLearner

CONFIG_FILE = "config.json"
SET_BY_TRAINER = {"policy", "env", "seed", "start", "device", "tensorboard_log", "verbose", "self"}
"""Arguments of algorithms that are not hyperparameters."""
# Errors of stable-baselines3 and PyTorch, beside ValueError, for unsuitable hyperparameters.
UNSUITABLE = (AssertionError, AttributeError, KeyError, RuntimeError, TypeError)
# Attributes of a saved model that describe its training only, such as paths.
EXCLUDED = (
    "tensorboard_log",
    "ep_info_buffer",
    "ep_success_buffer",
    "_last_obs",
    "_last_original_obs",
    "_last_episode_starts",
)


def train(config: TrainConfig, folder: Path, *, progress: bool = False, jobs: int = 1) -> Path:
    """Train a policy in a new folder, as `lgmd-gym train` does.

    The folder gets the configuration, logs, checkpoints or recorded episodes, policy.zip with the best model
    on the validation split, and README.md, its model card for the Hugging Face Hub. The best model has the
    highest mean return, or, on recorded episodes, the lowest loss.

    Args:
        config: Configuration of the training.
        folder: Training folder; must not exist.
        progress: Whether to print mean returns or metrics of epochs, with progress bars on a terminal.
        jobs: Number of processes that record episodes, and of threads that train the networks of an ensemble.

    Returns:
        Policy file.

    Raises:
        ValueError: If the configuration is invalid or the folder exists; nothing is written in that case.
    """
    check_whole("jobs", jobs, 1)
    check_config(config)
    new_folder(folder, "training folder")
    with complete_file(folder / CONFIG_FILE) as part:
        part.write_text(json.dumps(config.to_dict(), indent=2) + "\n", encoding="utf-8")
    return _train(config, folder, progress, jobs)


def resume(folder: Path, *, progress: bool = False, jobs: int = 1) -> Path:
    """Resume an interrupted training run with the configuration in its folder.

    It continues from the newest checkpoint that opens; damaged files are named on stderr. With
    "time-to-brake", it keeps the recorded files that are complete, records the others, and trains from the
    beginning. Args and return value are those of `train`.

    Raises:
        ValueError: If the folder contains no training, another process trains in it, or the recordings that
            it reuses are missing or damaged.
    """
    check_whole("jobs", jobs, 1)
    try:
        values = read_json(folder / CONFIG_FILE)
    except (OSError, ValueError):
        raise ValueError(
            f"{str(folder)!r} contains no training to resume (no readable {CONFIG_FILE})"
        ) from None
    config = TrainConfig.from_dict(values)
    if config.algo == TIME_TO_BRAKE:
        from lgmd_gym.training.recordings import check_recordings

        check_recordings(config)
    return _train(config, folder, progress, jobs)


def check_config(config: TrainConfig) -> None:
    """Check everything that can fail before training: environment, algorithm arguments, recordings.

    Raises:
        ValueError: For the first problem found.
    """
    env = config.make_policy_env("train")
    try:
        if config.algo == TIME_TO_BRAKE:
            from lgmd_gym.training.recordings import check_recordings

            _make_learner(config, env)
            check_recordings(config)
        else:
            _check_algorithm(config, env)
    finally:
        env.close()


def _check_algorithm(config: TrainConfig, env: PolicyWrapper) -> None:
    """Raise ValueError if stable-baselines3 cannot make the algorithm with its hyperparameters."""
    from lgmd_gym.training.online import algorithm_class, algorithm_kwargs

    algorithm: Any = algorithm_class(config.algo)
    known = inspect.signature(algorithm).parameters
    check_keys(f"hyperparameter of {config.algo}", config.algo_kwargs, {*known} - SET_BY_TRAINER)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # on the number of environments, one here
            algorithm(config.policy, env, seed=config.seed, device="cpu", **algorithm_kwargs(config))
    except (*UNSUITABLE, ValueError) as error:
        raise _cannot_make(config, error) from None


def _cannot_make(config: TrainConfig, error: Exception) -> ValueError:
    return ValueError(
        f"stable-baselines3 cannot make {config.algo} ({error_reason(error)}); "
        "correct the hyperparameters in the YAML file"
    )


def _train(config: TrainConfig, folder: Path, progress: bool, jobs: int) -> Path:
    """Train in a locked folder; a second process would mix its checkpoints and logs with these."""
    lock = FolderLock(folder, "training folder")
    try:
        return _write_policy(config, folder, progress, jobs)
    finally:
        lock.release()


def _write_policy(config: TrainConfig, folder: Path, progress: bool, jobs: int) -> Path:
    start = time.perf_counter()
    brake: TimeToBrakeParams | None = None
    # read before the training: the file may be gone after it
    first = None if config.start is None else read_card(find_policy(config.start))
    if config.algo == TIME_TO_BRAKE:
        model = _train_on_recordings(config, folder, progress, jobs)
        brake = TimeToBrakeParams.make(config.algo_kwargs.get("brake"))
    else:
        from lgmd_gym.training.online import train_online

        model = train_online(config, folder, progress)
    path = folder / "policy.zip"
    network = describe_network(model)
    values = config.to_dict() | {"recordings": None, "start": None}  # paths of this machine
    card = {
        "lgmd_gym": lgmd_gym.__version__,
        "algo": type(model).__name__.lower(),  # stable-baselines3 class that reads the file
        "camera": values["camera"],
        "neuron": plain_values(config.env_kwargs.get("params")),
        "features": values["features"],
        "demands": values["demands"] or None,
        "brake": None if brake is None else brake.to_dict(),
        "network": None if network is None else asdict(network),
        "config": values,
        "start": None if first is None else first.get("config", {}) | {"start": first.get("start")},
        "wall_time": round(time.perf_counter() - start, 1),
    }
    with complete_file(path) as part:
        model.save(part, exclude=EXCLUDED)
        write_card(part, card)
    write_model_card(config, folder, lgmd_gym.__version__)
    return path


def _train_on_recordings(config: TrainConfig, folder: Path, progress: bool, jobs: int) -> "PPO":
    """Record the missing episodes, train on them and write the metrics of each epoch to the folder."""
    from stable_baselines3.common.logger import configure
    from tqdm import tqdm

    from lgmd_gym.training.offline.dataset import StateDataset
    from lgmd_gym.training.recordings import load_or_record

    env = config.make_policy_env("train")
    learner = _make_learner(config, env)
    env.close()
    train_data, validation_data = (
        StateDataset(
            load_or_record(config, split, folder, progress, jobs), config.features, learner.brake.limits_s
        )
        for split in ("train", "validation")
    )
    logger = configure(str(folder / "log"), ["csv", "tensorboard"])
    try:
        disabled = None if progress else True  # None: unless stderr is a terminal
        with tqdm(total=learner.n_epochs, desc="training", unit="epoch", disable=disabled) as bar:

            def log(epoch: int, metrics: dict[str, float]) -> None:
                for name, value in metrics.items():
                    logger.record(name, value)
                logger.dump(epoch)
                if progress:
                    texts = ", ".join(f"{name} {value:.3g}" for name, value in metrics.items())
                    tqdm.write(f"epoch {epoch} of {learner.n_epochs}: {texts}")
                bar.update(epoch - bar.n)

            return learner.learn(train_data, validation_data, log, jobs)
    finally:
        logger.close()


def _make_learner(config: TrainConfig, env: PolicyWrapper) -> "TimeToBrakeLearner":
    """Return the learner of recorded episodes.

    Raises:
        ValueError: For an unknown hyperparameter, one out of range, or a network that cannot be made.
    """
    from lgmd_gym.training.offline.start import load_start
    from lgmd_gym.training.offline.time_to_brake import TimeToBrakeLearner

    known = {*inspect.signature(TimeToBrakeLearner).parameters} - SET_BY_TRAINER
    check_keys(f"hyperparameter of {config.algo}", config.algo_kwargs, known)
    try:
        start = None
        if config.start is not None:
            brake = TimeToBrakeParams.make(config.algo_kwargs.get("brake"))
            neuron = config.env_kwargs.get("params")
            start = load_start(config.start, config.features, config.camera, brake, neuron)
        return TimeToBrakeLearner(config.policy, env, seed=config.seed, start=start, **config.algo_kwargs)
    except UNSUITABLE as error:  # those of the learner itself are ValueErrors
        raise _cannot_make(config, error) from None

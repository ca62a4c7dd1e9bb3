"""`VideoRecorder`: videos of validation episodes in the training folder and in TensorBoard."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.wrappers import RenderCollection
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Image

from lgmd_gym.clips import VideoWriter
from lgmd_gym.rendering.window import dummy_display
from lgmd_gym.training.config import VALIDATION_SEED, TrainConfig
from lgmd_gym.training.policy_wrapper import PolicyWrapper

STRIP_LENGTH = 8  # pictures of an episode in TensorBoard


class VideoRecorder(BaseCallback):
    """Records the first validation episodes of the present policy every `frequency` calls.

    An episode becomes `videos/step-STEPS-episode-I.mp4`, with a picture per environment decision, and a film
    strip in TensorBoard. The environment is another one than those of the training and of the evaluations, so
    that the training is the same with and without videos. Add it before the callback that logs evaluations.

    Args:
        config: Configuration of the training; `videos` is the number of episodes.
        folder: Training folder.
        frequency: Number of calls between two recordings.
    """

    def __init__(self, config: TrainConfig, folder: Path, frequency: int) -> None:
        super().__init__()
        options = {**(config.env_kwargs.get("config") or {}), "offscreen_rendering": True}
        kwargs = config.env_kwargs | {"config": options, "render_mode": "rgb_array"}
        self._collection = RenderCollection(replace(config, env_kwargs=kwargs).make_env("validation"))
        self._env = PolicyWrapper(self._collection, **config.features_of("validation").to_dict())
        self._base: Any = self._env.unwrapped
        with dummy_display():
            self._env.reset()
        self._base.viewer.enabled = True  # highway-env disables drawing for dummy display drivers
        self._folder, self._frequency, self._episodes = folder / "videos", frequency, config.videos

    def _on_step(self) -> bool:
        if self.n_calls % self._frequency == 0:
            self._folder.mkdir(exist_ok=True)
            for index in range(self._episodes):
                self._record(index)
        return True

    def _on_training_end(self) -> None:
        self._env.close()

    def _record(self, index: int) -> None:
        pictures = self._play(VALIDATION_SEED + index)
        path = self._folder / f"step-{self.num_timesteps}-episode-{index}.mp4"
        path.unlink(missing_ok=True)  # of the state before a resumption
        with VideoWriter(path, self._base.config["policy_frequency"]) as writer:
            for picture in pictures:
                writer.write(picture)
        chosen = np.linspace(0, len(pictures) - 1, STRIP_LENGTH).round().astype(int)
        strip = Image(np.concatenate([pictures[i] for i in chosen]), "HWC")
        self.logger.record(f"eval/episode_{index}", strip, exclude=("stdout", "log", "json", "csv"))

    def _play(self, seed: int) -> list[np.ndarray]:
        """Return the pictures of an episode, each uint8 (height, width, 3)."""
        observation, _ = self._env.reset(seed=seed)
        done = False
        while not done:
            action, _ = self.model.predict(observation, deterministic=True)
            observation, _, terminated, truncated, _ = self._env.step(action)
            done = terminated or truncated
        return self._collection.render()  # type: ignore[return-value]

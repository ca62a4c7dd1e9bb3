"""Players of traffic: one agent in all episodes of a batch."""

from collections.abc import Sequence

import numpy as np

from lgmd_gym.agents import HOLD, BatchAgent
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.traffic.observer import Observed, Observer
from lgmd_gym.benchmark.traffic.reader import Moment, SceneReader
from lgmd_gym.benchmark.traffic.recording import TrafficRecording
from lgmd_gym.benchmark.traffic.replay import Replay


class LiveEpisode:
    """An episode of traffic that continues from a decision of a recording, with cameras of its own.

    Args:
        recording: The recording.
        decision: Number of the decision.
        sensor_config: Camera and neuron parameters.
        index: Index of the episode in the batch of its agent.
        num_envs: Number of episodes in that batch; the others are not played.
    """

    def __init__(
        self,
        recording: TrafficRecording,
        decision: int,
        sensor_config: SensorConfig,
        index: int = 0,
        num_envs: int = 1,
    ) -> None:
        self.env = recording.fork(decision)
        self._observer, self._index, self._num_envs = Observer(sensor_config, num_envs), index, num_envs
        sensors = self._observer.sensors
        sensors.set_scene(index, self.env.scene, self.env.brake.max_deceleration)
        sensors.set_road(index, self.env.road)
        for moment in recording.moments[: decision + 1]:
            self._observer.process(self._alone(moment))
        self._reader = SceneReader(self.env, sensors, index, recording.fps, decision)

    def step(self, demand: float) -> Observed:
        """Advance by one decision."""
        return self._observer.observe(self._alone(self._reader.step(demand)))

    def _alone(self, moment: Moment) -> list[Moment | None]:
        return [moment if index == self._index else None for index in range(self._num_envs)]


class AgentPlayer:
    """Plays one agent in the replays of a batch.

    Args:
        agent: The agent.
        num_envs: Number of episodes.
    """

    def __init__(self, agent: BatchAgent, num_envs: int) -> None:
        self._agent, self._num_envs = agent.for_envs(num_envs), num_envs

    def process(self, observed: Observed, replays: Sequence[Replay | None]) -> dict[int, BaseException]:
        """Process one decision of the replays of all episodes; None stands for one without.

        Returns:
            The exceptions of single episodes, by index.
        """
        asked = np.array([replay is not None and not replay.driver_only for replay in replays])
        demands, alerts, failures = np.zeros(self._num_envs), asked, dict[int, BaseException]()
        if asked.any():
            self._reset(asked, replays)
            demands = np.where(asked, self._agent.act(observed.observations, observed.infos, asked), HOLD)
            alerts, failures = asked & self._agent.alerts, dict(self._agent.failures)
        for index, (replay, moment) in enumerate(zip(replays, observed.moments, strict=True)):
            if replay is None or moment is None or index in failures:
                continue
            try:
                replay.process(moment, float(demands[index]), bool(alerts[index]))
            except Exception as error:
                failures[index] = error
        return failures

    def play_alone(self, replay: Replay, index: int, sensor_config: SensorConfig) -> None:
        """Play the replay of one episode from its first braking to its end, with cameras of its own."""
        live = LiveEpisode(replay.recording, replay.decision, sensor_config, index, self._num_envs)
        replay.env = live.env
        replays = [replay if number == index else None for number in range(self._num_envs)]
        while not replay.done:
            for error in self.process(live.step(replay.demand), replays).values():
                raise error

    def _reset(self, asked: np.ndarray, replays: Sequence[Replay | None]) -> None:
        """Reset the agent in the replays that require it."""
        chosen = zip(replays, asked.tolist(), strict=True)
        seeds = [replay.take_seed() if replay is not None and ask else None for replay, ask in chosen]
        fresh = np.array([seed is not None for seed in seeds])
        if fresh.any():
            self._agent.reset(fresh, seeds)

"""Agents in N environments: no demand depends on the other environments, on N, or on those that wait."""

import numpy as np
import pytest
from support.agents import NeuronResponse, TraceFrame
from support.policies import write_policy

from lgmd_gym.agents import AGENTS, make_agents
from lgmd_gym.agents.base import BatchAgent, InfoArrays
from lgmd_gym.agents.policies import policy as policies
from lgmd_gym.agents.zones import LOW_ZONES, NUM_ZONES

OPTIONS = {
    "random-brake": ":rate=1",
    "danger-zone": ":level=2,frames=2",
    "adaptive-threshold": ":threshold=20,gain=2",
    "stopping-zone": ":reach=0.75,ground=2,upright_frames=2",
    "frame-difference": ":level=1.3,frames=2,settle=1",
    "stopping-distance-oracle": ":margin=0.5",
    "tau-oracle": ":tau=5",
}
NUM_ENVS = 5


def random_step(rng, agent):
    """Return random observations and infos near the thresholds of the agents, with up to two frames."""
    cameras = len(agent.camera) if isinstance(agent.camera, list) else 1
    excitation = rng.gamma(1.5, 1.5, (NUM_ENVS, cameras))
    potential = 1.0 / (1.0 + np.exp(-excitation))
    frequency = 10.0 * rng.integers(0, 6, (NUM_ENVS, cameras)).astype(float)
    speeds = rng.uniform(0.0, 30.0, NUM_ENVS)
    turning = rng.random((NUM_ENVS, 1)) < 0.03
    observations = {
        "spike_frequency": frequency.astype(np.float32),
        "membrane_potential": potential.astype(np.float32),
        "ffi": rng.uniform(0.0, 9.0, (NUM_ENVS, cameras)).astype(np.float32),
        "ego_speed": speeds[:, None].astype(np.float32),
        "ego_yaw_rate": (turning * 0.1).astype(np.float32),
        "frame": (20 + rng.integers(0, 4, (NUM_ENVS, 12, 16, 1))).astype(np.uint8),
    }
    second = np.where(rng.random(NUM_ENVS) < 0.5, 1 / 30, np.nan)  # not all have a second frame
    response = NeuronResponse(frequency, potential)
    other = NeuronResponse(np.roll(frequency, 1, axis=0), np.roll(potential, 1, axis=0))
    frames = [TraceFrame(np.zeros(NUM_ENVS), speeds, other), TraceFrame(second, speeds, response)]
    infos = {
        "lgmd/alert": (frequency >= 30.0).any(axis=1),
        "lgmd/trace": frames,
        "ttc": rng.uniform(1.9, 8.0, NUM_ENVS),
        "gap": np.where(rng.random(NUM_ENVS) < 0.2, np.inf, rng.uniform(10.0, 900.0, NUM_ENVS)),
        "ego_speed": speeds,
        "target_speed": rng.uniform(0.0, 30.0, NUM_ENVS),
        "ttb": np.where(rng.random(NUM_ENVS) < 0.2, 0.0, rng.uniform(0.1, 4.0, NUM_ENVS)),
    }
    return observations, infos


def approach_step(rng, agent, step):
    """Return a random step in which the fields of `stopping-zone` are excited one after the other."""
    observations, infos = random_step(rng, agent)
    phase = 8.0 * ((step + 13 * np.arange(NUM_ENVS)) % 70)[:, None] / 70
    zones = np.array([*range(NUM_ZONES), *range(NUM_ZONES), *LOW_ZONES])
    entered = phase > NUM_ZONES - 1 - zones
    level = entered * np.repeat([8.0, 4.0, 6.0], (NUM_ZONES, NUM_ZONES, len(LOW_ZONES)))
    noise = rng.exponential(0.1, level.shape)
    observations["membrane_potential"] = (1.0 / (1.0 + np.exp(-level - noise))).astype(np.float32)
    return observations, infos


def select(values, index):
    """Return the row of one environment of nested arrays, with its axis."""
    if isinstance(values, dict):
        return {key: select(item, index) for key, item in values.items()}
    if isinstance(values, list):
        frames = [TraceFrame(*(select(item, index) for item in frame)) for frame in values]
        return [frame for frame in frames if not np.isnan(frame.time[0])]
    if isinstance(values, NeuronResponse):
        return NeuronResponse(*(select(item, index) for item in values))
    return values[index : index + 1]


def check_rows(name, steps, trace=True, draw=None):
    """Compare the rows of N environments with N = 1, and return the demands, shape (steps, N)."""
    rng = np.random.default_rng(5)
    together, alone = make_agents(name, NUM_ENVS), [make_agents(name, 1) for _ in range(NUM_ENVS)]
    seeds, demands = np.arange(NUM_ENVS), []
    started = np.ones(NUM_ENVS, np.bool_)
    for step in range(steps):
        together.reset(started, seeds)
        for index in np.flatnonzero(started):
            alone[index].reset(seeds=seeds[index : index + 1])
        observations, infos = draw(rng, together, step) if draw else random_step(rng, together)
        if not trace:
            del infos["lgmd/trace"]
        active = rng.random(NUM_ENVS) < 0.9
        acted = together.act(observations, InfoArrays(infos), active)
        assert (acted.shape, acted.dtype) == ((NUM_ENVS,), np.float64)
        for index in np.flatnonzero(active):
            single = alone[index]
            given = InfoArrays(select(infos, index))
            assert single.act(select(observations, index), given)[0] == acted[index], (step, index)
            assert single.alerts[0] == together.alerts[index], (step, index)
        demands.append(acted[active])
        started, seeds = rng.random(NUM_ENVS) < 0.03, rng.integers(100, size=NUM_ENVS)
    return np.concatenate(demands)


@pytest.mark.parametrize("trace", [True, False])
@pytest.mark.parametrize("name", AGENTS)
def test_rows_of_several_environments_equal_those_of_one(name, trace):
    if name == "flow-divergence":
        pytest.importorskip("cv2")
    demands = check_rows(name + OPTIONS.get(name, ""), 150, trace)
    if name not in ("no-brake", "always-brake", "flow-divergence"):
        assert 0.02 < np.mean(demands < 0.0) < 0.999, "the sequences hardly test the rule"


@pytest.mark.parametrize("lead", [policies.SAFE_LEAD, 1e9])
def test_demands_of_a_policy_do_not_depend_on_the_number_of_environments(monkeypatch, tmp_path, lead):
    pytest.importorskip("stable_baselines3")
    monkeypatch.setattr(policies, "SAFE_LEAD", lead)
    demands = check_rows(f"policy:{write_policy(tmp_path / 'small.zip')}", 120, draw=approach_step)
    assert 0.02 < np.mean(demands < 0.0) < 0.999


def test_a_policy_decides_for_several_environments_at_once(monkeypatch, tmp_path):
    pytest.importorskip("stable_baselines3")
    policy, calls = make_agents(f"policy:{write_policy(tmp_path / 'small.zip')}", NUM_ENVS), []
    monkeypatch.setattr(policy, "_decide_alone", lambda inputs, row: calls.append(row) or 0.0)
    observations, infos = random_step(np.random.default_rng(0), policy)
    policy.act(observations, InfoArrays(infos))
    assert len(calls) < NUM_ENVS


class Counter:
    """A user's class for one environment; it fails in its third decision with the seed 1."""

    def __init__(self, step=0.1):
        self.step, self.count, self.seed = step, 0, None

    def reset(self, seed):
        self.seed = seed

    def act(self, observation, info):
        assert info["lgmd/trace"][0].ego_speed == info["ego_speed"] == observation["ego_speed"][0]
        self.count += 1
        if self.seed == 1 and self.count == 3:
            raise RuntimeError("internal failure")
        return -self.step * self.count


def test_a_class_for_one_environment_has_one_object_for_each():
    agents = make_agents(f"{__name__}:Counter:step=0.25", 3)
    speeds, response = np.array([1.0, 2.0, 3.0]), NeuronResponse(np.zeros((3, 1)), np.zeros((3, 1)))
    observations = {"ego_speed": speeds[:, None]}
    trace = [TraceFrame(np.zeros(3), speeds, response)]
    infos = InfoArrays({"ego_speed": speeds, "lgmd/trace": trace})
    agents.reset(seeds=[0, 1, 2])
    first = agents.objects[0]
    assert agents.act(observations, infos).tolist() == [-0.25] * 3
    assert agents.act(observations, infos, np.array([True, True, False]))[:2].tolist() == [-0.5, -0.5]
    agents.reset(np.array([True, False, False]), [5, 5, 5])
    assert agents.objects[0] is not first  # one that has acted is made anew
    assert agents.objects[0].seed == 5
    assert agents.act(observations, infos)[[0, 2]].tolist() == [-0.25, -0.5]
    assert [str(error) for error in agents.failures.values()] == ["internal failure"]
    assert list(agents.failures) == [1]


class Counting(BatchAgent):
    """Replaces its state by what `convert` returns."""

    convert = staticmethod(np.asarray)

    def initial(self):
        return {"count": 0}

    def demands(self, observations, infos, active):
        self.state["count"] = self.convert(self.state["count"] + 1)
        return -0.1 * np.asarray(self.state["count"])


@pytest.mark.parametrize("convert", [list, lambda values: np.broadcast_to(values[:1], 3)])
def test_environments_that_are_not_active_keep_any_state(convert):
    agent = Counting().for_envs(3)
    agent.convert = convert
    for active, counts in (([1, 1, 1], [1, 1, 1]), ([1, 0, 1], [2, 1, 2])):
        agent.act({}, InfoArrays({}), np.array(active, np.bool_))
        assert list(agent.state["count"]) == counts
        agent.state["count"] = np.array(agent.state["count"])
    agent.reset(np.array([True, False, False]))
    assert agent.state["count"].tolist() == [0, 1, 2]


@pytest.mark.parametrize("demands", [-1.0, np.zeros(1), np.zeros((3, 1)), np.zeros(4)])
def test_demands_of_another_shape_are_refused(monkeypatch, demands):
    agent = BatchAgent().for_envs(3)
    monkeypatch.setattr(agent, "demands", lambda *_: demands, raising=False)
    with pytest.raises(ValueError, match=r"demands of agent agent must have shape \(3,\), got \("):
        agent.act({}, InfoArrays({}))

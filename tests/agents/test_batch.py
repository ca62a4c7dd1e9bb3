"""Agents in a batch of environments act like one agent per environment, to the bit."""

import numpy as np
import pytest
from support.agents import NeuronResponse, TraceFrame

from lgmd_gym.agents import AGENTS, make_agent
from lgmd_gym.agents.policies import batch as policy_batch
from lgmd_gym.agents.zones import LOW_ZONES, NUM_ZONES

BATCH_AGENTS = [name for name in AGENTS if make_agent(name).batch(1) is not None]
OPTIONS = {
    "graded": ":fall=0.5",
    "random-brake": ":rate=1",
    "nested-fields": ":level=1,frames=2",
    "stopping-zone": ":reach=0.75,ground=2,upright_frames=2",
}
NUM_ENVS = 7


def random_step(rng, agent):
    """Return a batch of random observations and infos near the thresholds of the rules."""
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
    }
    infos = {
        "lgmd/alert": (frequency >= 30.0).any(axis=1),
        "lgmd/trace": (TraceFrame(NeuronResponse(frequency, potential), speeds),),
    }
    return observations, infos


def approach_step(rng, step):
    """Return a random step in which the fields of `stopping-zone` are excited one after the other."""
    observations, infos = random_step(rng, make_agent("stopping-zone"))
    phase = 8.0 * ((step + 13 * np.arange(NUM_ENVS)) % 70)[:, None] / 70
    zones = np.array([*range(NUM_ZONES), *range(NUM_ZONES), *LOW_ZONES])
    entered = phase > NUM_ZONES - 1 - zones
    level = entered * np.repeat([8.0, 4.0, 6.0], (NUM_ZONES, NUM_ZONES, len(LOW_ZONES)))
    noise = rng.exponential(0.1, level.shape)
    observations["membrane_potential"] = (1.0 / (1.0 + np.exp(-level - noise))).astype(np.float32)
    return observations, infos


def single_step(observations, infos, index, trace):
    """Return the observation and info of one environment."""
    observation = {key: values[index] for key, values in observations.items()}
    info = {"lgmd/alert": bool(infos["lgmd/alert"][index])}
    if trace:
        (frame,) = infos["lgmd/trace"]
        response = NeuronResponse(*(values[index] for values in frame.response))
        info["lgmd/trace"] = [TraceFrame(response, float(frame.ego_speed[index]))]
    return observation, info


def check_batch(name, steps, trace=True, draw=None):
    """Compare a batch with single agents, and return the demands, shape (steps, environments)."""
    rng = np.random.default_rng(5)
    agents = [make_agent(name) for _ in range(NUM_ENVS)]
    batch = make_agent(name).batch(NUM_ENVS)
    for index, agent in enumerate(agents):
        agent.reset(index)
        batch.reset(index, index)
    active, demands = np.ones(NUM_ENVS, np.bool_), []
    for step in range(steps):
        observations, infos = draw(rng, step) if draw else random_step(rng, agents[0])
        given = infos if trace else {"lgmd/alert": infos["lgmd/alert"]}
        actions = batch.act_batch(observations, given, active)
        assert (actions.shape, actions.dtype) == ((NUM_ENVS, 1), np.float32)
        for index in range(NUM_ENVS):
            single = agents[index].act(*single_step(observations, infos, index, trace))
            assert single[0] == actions[index, 0], (step, index)
            assert agents[index].alert == batch.alerts[index], (step, index)
        demands.append(actions[:, 0])
        for index in np.flatnonzero(rng.random(NUM_ENVS) < 0.03):  # start new episodes
            seed = int(rng.integers(100))
            agents[index].reset(seed)
            batch.reset(index, seed)
    return np.array(demands)


def test_rules_and_baselines_have_batches():
    assert set(BATCH_AGENTS) == {
        "no-brake", "always-brake", "random-brake", "spike-threshold", "adaptive-threshold", "graded",
        "speed-gated", "nested-fields", "danger-zone", "stopping-zone",
    }  # fmt: skip


@pytest.mark.parametrize("trace", [True, False])
@pytest.mark.parametrize("name", BATCH_AGENTS)
def test_batch_equals_single_agents_on_random_sequences(name, trace):
    demands = check_batch(name + OPTIONS.get(name, ""), 400, trace)
    if name not in ("no-brake", "always-brake"):
        assert 0.02 < np.mean(demands < 0.0) < 0.999, "the sequences hardly test the rule"


@pytest.mark.parametrize("lead", [policy_batch.SAFE_LEAD, 1e9])
def test_batch_of_a_policy_equals_single_policies(monkeypatch, lead):
    pytest.importorskip("stable_baselines3")
    monkeypatch.setattr(policy_batch, "SAFE_LEAD", lead)
    demands = check_batch("policy:zones", 120, draw=approach_step)
    assert 0.02 < np.mean(demands < 0.0) < 0.999


def test_policy_decides_for_several_environments_at_once(monkeypatch):
    pytest.importorskip("stable_baselines3")
    policy = make_agent("policy:zones")
    batch, calls = policy.batch(NUM_ENVS), []
    monkeypatch.setattr(policy, "decide", lambda inputs: calls.append(inputs) or 0.0)
    observations, infos = random_step(np.random.default_rng(0), policy)
    batch.act_batch(observations, infos, np.ones(NUM_ENVS, np.bool_))
    assert len(calls) < NUM_ENVS

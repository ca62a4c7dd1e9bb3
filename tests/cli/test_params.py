"""Neuron parameters that have no effect on an agent."""

import gymnasium as gym
import pytest

import lgmd_gym
from lgmd_gym.agents import AGENTS, make_agent
from lgmd_gym.cli import main as cli

BLIND = [name for name, cls in AGENTS.items() if not cls.reads_neuron]


def demands(name, params):
    agent = make_agent(name)
    arguments = {"camera": agent.camera or "fovea", "include_frame": agent.include_frame}
    env = gym.make("LGMD/CCRs-v0", ego_speed=6.0, params=params, config=agent.config, **arguments)
    observation, info = env.reset(seed=0)
    agent.reset(0)
    actions, done = [], False
    while not done:
        actions.append(float(agent.act(observation, info)[0]))
        observation, _, terminated, truncated, info = env.step(actions[-1:])
        done = terminated or truncated
    return actions


def test_agents_that_do_not_read_the_neuron():
    assert {"no-brake", "ttc-oracle", "frame-difference"} <= set(BLIND)
    assert {"spike-threshold", "stopping-zone", "danger-zone"}.isdisjoint(BLIND)


@pytest.mark.parametrize("name", BLIND)
def test_parameters_do_not_change_their_demands(name):
    if name == "flow-divergence":
        pytest.importorskip("cv2")
    other = lgmd_gym.LGMDParams(t_sp=0.9, sigma_3=2.0)
    assert demands(name, None) == demands(name, other)


@pytest.mark.parametrize(("agent", "noted"), [("ttc-oracle", True), ("spike-threshold", False)])
@pytest.mark.parametrize("command", ["drive", "bench"])
def test_parameters_without_effect_are_noted(command, agent, noted, tmp_path, capsys):
    params = tmp_path / "params.toml"
    params.write_text("t_sp = 0.8\n")
    given = {
        "drive": ["drive", "LGMD/EmptyRoad-v0", "--agent", agent],
        "bench": ["bench", "--suite", "r152", "--seeds", "1", "--jobs", "1", "--no-plots", "--no-report",
                  "--agents", agent, "no-brake", "--out", str(tmp_path / "run")],
    }[command]  # fmt: skip
    assert cli.run([*given, "--params", str(params)]) == 0
    message = capsys.readouterr().err
    names = [agent] * noted + ["no-brake"] * (command == "bench")
    line = f"lgmd-gym: --params {params} does not change the braking of {', '.join(names)}, which"
    assert (line in message) == bool(names)

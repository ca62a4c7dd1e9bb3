"""How policies see the road, how they are trained, and that a trained one acts as it was trained to."""

import json
import re
import zipfile

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import lgmd_gym  # noqa: F401
from lgmd_gym.agents import make_agent
from lgmd_gym.agents.policies.policy import find_policy, read_card
from lgmd_gym.cli import main as cli
from lgmd_gym.training import PolicyView
from lgmd_gym.training.config import DEMANDS, Order
from lgmd_gym.training.hyperparameters import read_settings
from lgmd_gym.training.online import newest_checkpoint
from lgmd_gym.training.trainer import Training

YAML = """
LGMD/CCRs-v0:
  env_wrapper:
    - lgmd_gym.training.PolicyView: {history: 2, repeat: 4}
  n_envs: 2
  n_timesteps: 64
  learning_rate: lin_0.001
  n_steps: 16
  batch_size: 16
  policy_kwargs: {net_arch: [8]}
"""


@pytest.mark.filterwarnings("ignore")
def test_policy_view_is_a_sound_environment():
    from stable_baselines3.common.env_checker import check_env as check_sb3

    env = PolicyView(gym.make("LGMD/CCRs-v0", include_frame=True), inputs=["spike_frequency", "frame"])
    assert env.observation_space["frame"].shape == (45, 80, 6)
    check_env(env, skip_render_check=True)
    check_sb3(env)
    env.close()


def test_policy_view_holds_actions_and_adds_up_rewards():
    plain, held = gym.make("LGMD/CCRs-v0"), PolicyView(gym.make("LGMD/CCRs-v0"), repeat=5, history=1)
    plain.reset(seed=4)
    held.reset(seed=4)
    for _ in range(4):
        rewards = [plain.step(np.array([-0.3], np.float32)) for _ in range(5)]
        shown, reward, *_ = held.step(np.array([-0.3], np.float32))
        assert reward == pytest.approx(sum(item[1] for item in rewards))
        assert shown["ego_speed"][0] == pytest.approx(rewards[-1][0]["ego_speed"][0] / 20.0)


def test_a_latched_brake_is_held_to_the_end():
    levels = {"action": {"type": "DiscreteDemand", "levels": [0.0, -0.4, -1.0]}}
    plain, held = (gym.make("LGMD/CCRs-v0", config=levels) for _ in range(2))
    view = PolicyView(held, inputs=["ego_speed"], latch=True, reward_scale=0.5)
    plain.reset(seed=4)
    view.reset(seed=4)
    for action in (0, 1):  # light braking does not latch
        total = sum(float(plain.step(action)[1]) for _ in range(3))
        _, reward, *ends, _ = view.step(action)
        assert reward == pytest.approx(0.5 * total)
        assert ends == [False, False]
    total, done = 0.0, False
    while not done:
        _, reward, terminated, truncated, _ = plain.step(2)
        total, done = total + float(reward), terminated or truncated
    _, reward, *ends, info = view.step(2)
    assert reward == pytest.approx(0.5 * total)
    assert ends == [True, False]  # nothing is left to decide
    assert not info["collision"]


def test_nothing_is_drawn_that_nobody_looks_at(monkeypatch):
    from lgmd_gym.sensing.sensor_array import SensorArray

    drawn, render = [], SensorArray.render
    monkeypatch.setattr(SensorArray, "render", lambda *arguments: (drawn.append(1), render(*arguments)))
    view = PolicyView(gym.make("LGMD/CCRs-v0"), inputs=["ego_speed"], latch=True)
    for _ in range(2):
        drawn.clear()
        view.reset(seed=4)
        view.step(np.array([0.0], np.float32))
        assert len(drawn) == 1 + 3
        view.step(np.array([-1.0], np.float32))  # to the end
        assert len(drawn) == 1 + 3


def test_a_policys_eye_is_an_agents_own_or_refused():
    plan = Order(eye="stopping-zone").plan()
    assert [camera["name"] for camera in plan.camera][:1] == ["ground10"]
    assert Order(camera=("wide",)).plan().camera == "wide"
    assert Order().plan().camera == ["fovea", "tele", "wide"]
    with pytest.raises(ValueError, match="agent 'spike-threshold' has no eye of its own"):
        Order(eye="spike-threshold").plan()


def test_looks_are_told_in_the_environments_own_returns():
    plan = Order("dqn", "LGMD/CCRs-v0", demands=(0.0, -1.0)).plan()
    assert plan.features["reward_scale"] == 0.05
    told = []
    for split in ("train", "validation"):
        env = plan.make_env(split)
        env.reset(seed=1)
        told.append(env.step(1)[1])
    assert told[0] == pytest.approx(0.05 * told[1])
    assert abs(told[1]) > 1.0


def test_a_missing_frame_is_named_with_the_mend():
    with pytest.raises(ValueError, match="'frame' is not observed; make it with include_frame=True"):
        PolicyView(gym.make("LGMD/CCRs-v0"), inputs=["frame"])


@pytest.mark.parametrize("algo", ["ppo", "sac", "dqn"])
def test_the_packages_hyperparameters_are_read(algo):
    settings = read_settings(algo, "LGMD/RandomBraking-v0")
    assert settings.n_timesteps >= 100_000
    assert (settings.features["history"], settings.features["repeat"]) == (6, 3)
    assert settings.features.get("latch", False) is (algo == "dqn")
    assert settings.features == read_settings(algo, "LGMD/CCRs-v0").features


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: [", "are no YAML"),
        ("- 3", "need entries by environment id"),
        ("LGMD/CCRm-v0: {}", "did you mean 'LGMD/CCRm-v0'"),
        ("default: {normalize: true}", "normalize is not taken"),
        ("default: {n_timesteps: many}", "n_timesteps must be a number, got 'many'"),
        ("default: {env_wrapper: gymnasium.wrappers.FlattenObservation}", "env_wrapper must be lgmd_gym"),
    ],
)
def test_bad_hyperparameters_are_refused(tmp_path, text, words):
    file = tmp_path / "hyper.yml"
    file.write_text(text)
    with pytest.raises(ValueError, match=words):
        read_settings("ppo", "LGMD/CCRs-v0", file)


def order(tmp_path, **changes):
    file = tmp_path / "hyper.yml"
    file.write_text(YAML)
    given = {
        "algo": "ppo",
        "env_id": "LGMD/CCRs-v0",
        "camera": ("fovea",),
        "hyperparams": file,
        "eval_every": 32,
    }
    return Order(**given | {"eval_episodes": 1} | changes)


@pytest.mark.parametrize(("demands", "latch"), [((), False), (DEMANDS, False), ((-1.0, 0.0), True)])
def test_a_trained_policy_acts_as_the_model_does(tmp_path, demands, latch):
    """With a latch, the first demand is full braking, which an untrained network chooses soon enough."""
    from stable_baselines3 import PPO

    wanted = order(tmp_path, demands=demands)
    if latch:
        wanted.hyperparams.write_text(YAML.replace("repeat: 4", "repeat: 4, latch: true"))
    path = Training.start(wanted, tmp_path / "run").run()
    assert path.stat().st_size < 1_000_000
    card = read_card(path)
    assert card["camera"] == "fovea"
    assert card["features"]["repeat"] == 4
    agent = make_agent(f"policy:{path}")
    model = PPO.load(path, device="cpu")
    view = wanted.plan().make_env("train")
    env = gym.make("LGMD/CCRs-v0", camera=agent.camera)
    (shown, _), (observation, info) = view.reset(seed=3), env.reset(seed=3)
    agent.reset(3)
    for _ in range(6):
        action, _ = model.predict(shown, deterministic=True)
        shown, _, over, *_ = view.step(action)
        for _ in range(40 if over else 4):
            done = agent.act(observation, info)
            assert done == np.float32(demands[action] if demands else action)
            observation, *_, info = env.step(done)
        if over:
            break
    assert over is latch
    with pytest.raises(ValueError, match="exists and is kept"):
        Training.start(wanted, tmp_path / "run")


def test_trainings_of_neighbouring_seeds_share_no_levels(tmp_path, monkeypatch):
    """stable-baselines3's constructor seeds environment i with seed + i; what counts is the last seeding."""
    from stable_baselines3.common.vec_env import DummyVecEnv

    given, seed = [], DummyVecEnv.seed
    monkeypatch.setattr(DummyVecEnv, "seed", lambda self, value: (given.append(value), seed(self, value))[1])
    for number in (0, 1):
        given.clear()
        Training.start(
            order(tmp_path, steps=32, eval_every=10_000, seed=number), tmp_path / f"{number}"
        ).run()
        assert given[-1] == 1_000_000 * number


def test_a_training_goes_on_from_its_checkpoint(tmp_path):
    run = Training.start(order(tmp_path, steps=32), tmp_path / "run")
    run.run()
    told = json.loads((tmp_path / "run" / "plan.json").read_text())
    (tmp_path / "run" / "plan.json").write_text(json.dumps(told | {"n_timesteps": 96}))
    best = np.load(tmp_path / "run" / "best" / "evaluations.npz")["results"].mean()
    (tmp_path / "hyper.yml").write_text("default: {n_envs: 7}")  # a training goes by its own plan
    again = Training.resume(tmp_path / "run")
    assert newest_checkpoint(tmp_path / "run").name == "model_32_steps.zip"
    again.run()
    assert newest_checkpoint(tmp_path / "run").name == "model_96_steps.zip"
    assert read_card(again.policy)["config"] == told | {"n_timesteps": 96}
    looks = np.load(tmp_path / "run" / "best" / "evaluations.npz")
    assert looks["timesteps"].tolist() == [32, 64, 96]  # the first look has not been forgotten
    assert looks["results"][0].mean() == best


@pytest.mark.slow
@pytest.mark.parametrize("algo", ["sac", "dqn"])
def test_other_algorithms_train(tmp_path, algo):
    text = "default: {n_envs: 2, n_timesteps: 400, learning_starts: 100, policy_kwargs: {net_arch: [8]}}"
    (tmp_path / "off.yml").write_text(text)
    wanted = order(tmp_path, algo=algo, hyperparams=tmp_path / "off.yml", eval_every=200)
    agent = make_agent(f"policy:{Training.start(wanted, tmp_path / 'run').run()}")
    observation, info = gym.make("LGMD/CCRs-v0", camera=agent.camera).reset(seed=0)
    demand = agent.act(observation, info)
    assert demand.shape == (1,)
    assert algo == "sac" or float(demand[0]) in np.float32(DEMANDS)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("policy:zone", "neither a file nor shipped. 'zone'; did you mean 'zones'"),
        ("policy:nowhere.zip", "policy 'nowhere.zip' cannot be read: No such file"),
        ("policy:pyproject.toml", "is no policy of lgmd-gym train"),
        ("no-brake,ttc-oracle", "separate agents by spaces"),
    ],
)
def test_bad_policies_are_named(text, words):
    with pytest.raises(ValueError, match=words):
        make_agent(text)


def test_the_shipped_policy_is_small_sound_and_tells_nothing_of_its_maker():
    file = find_policy("zones")
    assert file.stat().st_size < 1_000_000
    with zipfile.ZipFile(file) as parts:
        assert not any(re.search(rb"/(tmp|home|root|work)/", parts.read(name)) for name in parts.namelist())
    plan = read_card(file)["config"]
    assert plan["camera"] == make_agent("stopping-zone").camera  # the rule's eye, as it is now
    assert plan["model"] == read_settings("recorded", plan["env_id"]).model  # as its training is described


@pytest.mark.parametrize("family", ["CCRs", "EmptyRoad"])
def test_the_shipped_policy_brakes_for_a_car_and_not_for_a_road(family):
    agent = make_agent("policy:zones")
    env = gym.make(f"LGMD/{family}-v0", ego_speed=11.0, camera=agent.camera)
    observation, info = env.reset(seed=1)
    agent.reset(1)
    braked = done = False
    while not done:
        action = agent.act(observation, info)
        braked = braked or bool(action[0] < 0)
        assert agent.alert is bool(action[0] < 0)  # whatever the neurons of its twenty cameras alert
        observation, _, terminated, truncated, info = env.step(action)
        done = terminated or truncated
    assert braked is (family == "CCRs")
    assert not info["collision"]


@pytest.mark.parametrize("acceleration", [3.0, 0.5, -3.0])
def test_the_shipped_policy_takes_no_offence_at_the_drivers_foot(acceleration):
    """An earlier one was shown how its speed changed, which it never did in what it learnt from."""
    agent = make_agent("policy:zones")
    times = np.arange(0.0, 8.0, 1 / 30)
    speeds = (0.0 if acceleration > 0 else 24.0) + acceleration * times
    for speed in speeds:
        seen = {
            "membrane_potential": np.full(20, 0.55, np.float32),
            "ego_speed": np.array([speed], np.float32),
            "ego_yaw_rate": np.zeros(1, np.float32),
        }
        assert agent.act(seen, {})[0] == 0.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--algo", "pppo"], "unknown algorithm 'pppo'; did you mean 'ppo'?"),
        (["--inputs", "spikes"], "unknown policy input 'spikes'"),
        (["--camera", "fovae"], "did you mean 'fovea'?"),
        (["--hyperparams", "nowhere.yml"], "hyperparameters 'nowhere.yml' cannot be read"),
        (["--resume", "nowhere"], "holds no training to resume"),
        (["--inputs", "zones"], "needs the eye of stopping-zone with 20 cameras, got 3; train with --eye"),
        (["--eye", "stopping-zone", "--camera", "wide"], "give either camera or eye"),
        (["--steps", "0"], "steps must be a whole number >= 1, got 0"),
        (["--jobs", "0"], "jobs must be a whole number >= 1, got 0"),
        (["--eval-episodes", "0"], "eval_episodes must be a whole number >= 1, got 0"),
    ],
)
def test_bad_training_is_one_line_and_exit_code_two(arguments, words, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert cli.run(["train", *arguments]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert words in said
    assert list(tmp_path.iterdir()) == []

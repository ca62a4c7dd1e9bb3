"""The scripts in docs/examples run and print plausible results."""

import re
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from support.examples import EXAMPLES, load
from support.rows import threat_row

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark import RunConfig
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.stored_run import StoredRun
from lgmd_gym.benchmark.suites import Suite


@pytest.mark.slow
def test_braking_benchmark(tmp_path, capsys):
    load("braking_benchmark").main(tmp_path / "run", tmp_path / "picture.png")
    lines = capsys.readouterr().out.splitlines()
    oracle = next(line for line in lines if line.startswith("ttc-oracle"))
    assert "avoided 12/12" in oracle
    assert "false activations 0/7" in oracle
    assert (tmp_path / "picture.png").stat().st_size > 10_000


def test_scenario_evaluation(capsys, tmp_path):
    example = load("scenario_evaluation")
    example.main(tmp_path / "picture.png", cameras=("wide", "fovea"), speeds=(30,), seeds=1)
    wide, fovea, needed = [float(value) for value in re.findall(r"([\d.]+) s", capsys.readouterr().out)]
    assert 0.0 < wide < fovea < 4.0
    assert needed == pytest.approx(0.70, abs=0.01)  # 8.33 m/s / (2 · 9 m/s²) and 0.23 s
    assert (tmp_path / "picture.png").stat().st_size > 10_000


def test_bodies(tmp_path):
    sheet = load("bodies").main(tmp_path / "bodies.png", quick=True)
    assert list(sheet) == ["motorcycle", "small"]
    assert list(sheet["small"]) == ["day, side", "day, rear", "day, front"]
    assert sheet["motorcycle"]["day, front"].max() == 255  # the headlight


def test_contact_sheet(tmp_path):
    sheet = load("contact_sheet").main(tmp_path / "sheet.png", quick=True)
    assert [list(row) for row in sheet.values()] == [["clear", "night"]] * 2
    assert all(row["night"].mean() < 0.5 * row["clear"].mean() for row in sheet.values())
    assert 10_000 < (tmp_path / "sheet.png").stat().st_size < 200_000


@pytest.mark.slow
def test_side_fields(tmp_path):
    """The car comes from the left and the two levels differ by it only: the fields at the right are equal."""
    with_car, without = load("side_fields").main(tmp_path / "fields.png")
    assert np.array_equal(with_car[3:], without[3:])
    assert (np.abs(with_car[0] - without[0]) > 1.0).any()  # grey levels of the far field at the left
    assert 10_000 < (tmp_path / "fields.png").stat().st_size < 200_000


def test_turning_views(tmp_path):
    """Derotation removes most of the change of light before the oncoming car is large."""
    steady, derotated = load("turning_views").main(tmp_path / "views.png")
    assert (derotated[:3] < 0.5 * steady[:3]).all()
    assert derotated[3] > 2.0 * derotated[0]
    assert 10_000 < (tmp_path / "views.png").stat().st_size < 200_000


def test_ablations(tmp_path, capsys):
    example = load("ablations")
    arguments = ["--worlds", "2", "--seeds", "1", "--every", "14", "--to", str(tmp_path / "arms.png")]
    arms = ["complete sensor", "half the pixels per row and column", "60 frames/s"]
    rates = example.main(["stopping-zone", *arguments, "--arms", *arms])
    assert list(rates) == arms
    assert {suite: rate.n for suite, rate in rates[arms[1]].items()} == {"r152": 2, "false-reaction": 3}
    assert capsys.readouterr().out.count("\n") == 5
    assert (tmp_path / "arms.png").stat().st_size > 5_000
    camera = make_agent("stopping-zone").camera[0]
    assert example.ARMS[arms[1]](camera) == camera | {"shape": [9, 40]}
    assert example.ARMS["no stabilisation"](camera) == camera | {"stabilised": False}
    with pytest.raises(ValueError, match="agent 'ttc-oracle' has no cameras of its own"):
        example.main(["ttc-oracle", *arguments])


@pytest.mark.slow
def test_target_signal(capsys):
    """All sensors are compared on the same levels, and a network learns a feature that shows the target."""
    example = load("target_signal")
    areas = example.main(["--levels", "25", "--jobs", "1"])
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("| fields at the sides | all | CBFA | ")
    assert len(lines) == 2 + len(areas) == 8
    assert all(0.0 <= value <= 1.0 for values in areas.values() for value in values.values())
    assert example.area(np.array([[2.0, 1.0], [4.0, 3.0]])) == 0.75
    (pair,) = example.record(example.side_cameras(), 1, 1)
    assert [item.threat for item in pair] == [True, False]
    lgmd = example.features(pair[0], 40, [0])
    pair[0].observations["column_potential"][:, example.NUM_SIDE_FIELDS * example.SIDE_COLUMNS :] = 0.9
    assert np.array_equal(example.features(pair[0], 40, [0]), lgmd)  # not of the other models
    assert not np.array_equal(example.features(pair[0], 40, [1]), lgmd)
    rng = np.random.default_rng(0)
    train, test = rng.normal(size=(2, 80, 2, 5)).astype(np.float32)
    train[:, 0, 2] += 4.0
    test[:, 0, 2] += 4.0
    assert example.area(example.fit_and_score(train, test)) > 0.95


@pytest.mark.slow
def test_deviations(capsys):
    effects = load("deviations").main()
    assert capsys.readouterr().out.count("\n") == 2 + len(effects)
    default, literal = effects["default"], effects["`literal`"]
    assert (default.silent_gratings, default.frames[2]) == (30, 0)
    assert literal.silent_gratings < 30
    assert literal.peak > effects["spikes from K (eq. 11)"].peak > default.peak


@pytest.mark.slow
def test_on_record(capsys):
    """The result on recorded episodes equals that of the closed loop."""
    example = load("on_record")
    episodes = example.record("stopping-zone", 4, jobs=1)
    results = example.evaluate("stopping-zone", episodes)
    env = gym.make("LGMD/RandomBraking-v0", split="test", camera=make_agent("stopping-zone").camera)
    for seed, (ret, contact, brakes) in enumerate(results):
        agent = make_agent("stopping-zone")
        observation, info = env.reset(seed=seed)
        agent.reset(seed)
        total, braked, done = 0.0, False, False
        while not done:
            action = agent.act(observation, info)
            braked = braked or bool(action[0] < 0.0)
            observation, reward, terminated, truncated, info = env.step(action)
            total, done = total + float(reward), terminated or truncated
        assert ret == pytest.approx(total, abs=0.15)  # returns between replays are interpolated
        assert (bool(contact), bool(brakes)) == (info["collision"], braked)
    assert {brakes for *_, brakes in results} == {0.0, 1.0}
    example.record = lambda agent, count: episodes
    example.main(["4", "stopping-zone", "no-brake+stopping-zone"])
    rule, mean = capsys.readouterr().out.splitlines()[2:]
    assert rule.endswith("stopping-zone")
    assert "+0.00 [+0.00, +0.00]" in rule
    assert mean.endswith("no-brake+stopping-zone")


@pytest.mark.slow
def test_what_breaks_first(capsys):
    """A camera that points at the sky makes the rule miss the targets that it avoids otherwise."""
    example = load("what_breaks_first")
    example.CHANGES["camera pitched up 20°"] = (example.pitched(20.0), {})
    example.first_table("stopping-zone", 1, 1, ("clear", "camera pitched up 20°"), every=14)
    clear, sky = capsys.readouterr().out.splitlines()[2:]
    assert clear.startswith("| clear | 2/2 [34–100] | 0/2 [0–66] | 1/3 ")
    assert clear.endswith("| 2 cases in 1 world, 3 cases in 1 world |")  # threats, non-threats
    assert sky.startswith("| camera pitched up 20° | 0/2 ")
    example.second_table("stopping-zone", 1, 1, every=6)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "| target, texture: 1 case in 1 world | day | night | fog |"
    assert len(lines) == 2 + 9
    assert "| light (220), texture 1.6 | 1/1 " in "".join(lines)


def test_every_example_has_a_test():
    tested = "".join(path.read_text() for path in Path(__file__).parent.glob("test_*.py"))
    assert all(f'load("{path.stem}")' in tested for path in EXAMPLES.glob("*.py"))


def test_picture(tmp_path):
    from PIL import Image

    load("picture").main(tmp_path / "view.png", tmp_path / "film.gif", ego_speed=5.0, after=2)
    assert Image.open(tmp_path / "view.png").size == (1280, 720)
    film = Image.open(tmp_path / "film.gif")
    assert film.size == (800, 450)
    assert film.n_frames > 20


def test_vector_gymnasium(capsys):
    episodes, contacts = load("vector_gymnasium").main(num_envs=8, steps=300)
    assert f"2400 decisions: {episodes} episodes, contact in {contacts}" in capsys.readouterr().out
    assert 8 <= episodes < 100
    assert contacts < episodes


def test_vector_sb3(capsys):
    torch = pytest.importorskip("torch")
    pytest.importorskip("stable_baselines3")
    model = load("vector_sb3").main(steps=512, num_envs=4, episodes=4)
    assert model.num_timesteps == 512
    assert all(bool(torch.isfinite(weight).all()) for weight in model.policy.parameters())
    assert "512 steps: return " in capsys.readouterr().out


def test_all_scores():
    """One column per run; cases with an FCW driver are left out."""
    config = RunConfig(suite="r152", agents=("no-brake", "a"), seeds=1)
    values = {"avoided": True, "premature_brake": False, "speed_reduction": 5.0, "fcw_driver": False}
    rows = [
        threat_row(case=f"r152/CCRs/v{speed}", world=world, **values)
        for speed, world in ((20, 8000), (40, 8001))
    ]
    rows.append(rows[0] | {"fcw_driver": True, "avoided": False, "seed": 1})
    false = [row | {"threat": False, "false_activation": row["world"] == 8000} for row in rows[:2]]
    quiet = RunConfig(suite="false-reaction", agents=("a",), seeds=1, worlds=0)
    drive = {"distance": 5e4, "false_activations": 1, "moving_time": 9.0, "needed_time": 0.0}
    drive |= {"side": "", "alerts": 1, "brakes": 1, "collision": False, "peak_deceleration": 9.0}
    traffic = RunConfig(suite="traffic", agents=("a",), seeds=1, conditions=("mixed",))
    runs = [StoredRun(config, rows, False), StoredRun(quiet, false, False)]
    runs.append(StoredRun(traffic, [rows[0] | drive | {"threat": False}], False))
    example = load("all_scores")
    heading, _, none, a = example.table([example.column(run) for run in runs])
    assert "r152: avoided, 2 cases in 2 worlds, clear" in heading
    assert "false-reaction: false activations, 2 cases in the laboratory, clear" in heading
    assert "traffic: false activations per 100 km, 1 case in 1 world, mixed" in heading
    assert a.startswith("| a | 2/2 [")
    assert "| 1/2 [" in a
    assert "| 2.0 [" in a
    assert none == "| no-brake | – | – | – |"


def test_real_cars():
    """A line per agent and run; premature braking and contact are failures."""
    cases = ("CCRs/v10", "CCRs/v80", "CCRm/v70", "CCRm/v60", "CCRb/v80/brake0.5g-gap12")
    impact = {"collision": True, "avoided": False, "relative_impact_speed": 10 / 3.6}
    rows = [threat_row(case=f"fmvss127/{case}", avoided=True) for case in cases]
    rows[1] |= impact
    rows.append(rows[0] | {"seed": 1, "avoided": False, "premature_brake": True})
    config = RunConfig(suite="fmvss127", agents=("a",), seeds=2)
    *_, line = load("real_cars").table([StoredRun(config, rows, False)])
    assert line == "| `a`, worlds | 1/3 (10 km/h) | 1/1 | 0/0 | 1/1 |"


def test_frontier(tmp_path, capsys, monkeypatch):
    script, picture = load("frontier"), tmp_path / "frontier.png"
    arguments = ["frontier.py", "--suites", "r152-vru", "--camera", "standard", "--to", str(picture)]
    monkeypatch.setattr("sys.argv", arguments)
    script.main()
    heads, _, bicycle, pedestrian = capsys.readouterr().out.splitlines()
    assert "growth in `standard` [px/frame]" in heads
    assert len({line.count("|") for line in (heads, bicycle, pedestrian)}) == 1
    assert bicycle.startswith("| CBNA | 4 | 4/4 |")
    assert pedestrian.startswith("| CPNA | 4 | 4/4 |")
    assert picture.stat().st_size > 10_000


def test_protocol_counts(tmp_path, monkeypatch):
    """Files of a family with locations or turns in its name count as that family."""
    script = load("protocol_counts")
    for pattern in script.FILES.values():
        file = tmp_path / pattern.replace("*", "x")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    families = ("CPNA-25", "CPTAfs", "CPRA_Cm", "CCRs")
    cells = tuple(Case(f"x/{family}/v10", "Scenario", fcw_driver=family == "CCRs") for family in families)
    monkeypatch.setattr(script, "read", lambda path: Suite("x", cells, ""))
    lines = script.table(tmp_path)
    assert lines[0] == "| family | ncap2023 | ncap2023-vru | ncap2026 | ncap2026-extended |"
    assert "| CPNA | 0 / 1 | 22 / 1 | 36 / 1 | 24 / 1 |" in lines
    assert "| CPTA | 0 / 1 | 8 / 1 | 0 / 1 | 0 / 1 |" in lines
    assert "| CCRs warned | 30 / 1 | 0 / 1 | 15 / 1 | 6 / 1 |" in lines
    assert lines[-1] == "| all | 177 / 4 | 133 / 4 | 428 / 4 | 435 / 4 |"
    with pytest.raises(ValueError, match=r"no file .*Variation\*.xosc in '.*other'; pass the folder NCAP"):
        script.table(tmp_path / "other")


def test_family_scores():
    config = RunConfig(suite="r152", agents=("no-brake", "a"), seeds=1)
    values = {"premature_brake": False, "speed_reduction": 5.0, "fcw_driver": False}
    cases = (("CCRs/v20", True), ("CCRs/v40", False), ("CCRm/v30", True))
    rows = [threat_row(case=f"r152/{case}", avoided=avoided, **values) for case, avoided in cases]
    script, run = load("family_scores"), StoredRun(config, rows, False)
    _, _, slower, standing = script.table(["a"], [run])
    assert slower.startswith("| r152 | CCRm | 1/1 [")
    assert standing.startswith("| r152 | CCRs | 1/2 [")
    with pytest.raises(ValueError, match="the run of r152 has no agent 'b'; it has no-brake, a"):
        script.table(["b"], [run])
    with pytest.raises(ValueError, match="traffic has no families"):
        script.table(["a"], [run._replace(config=replace(config, suite="traffic"))])


def test_detections():
    config = RunConfig(suite="ncap2023", agents=("no-brake", "a"), seeds=1)
    values = {"premature_brake": False, "speed_reduction": 5.0, "fcw_driver": False}
    runs = []
    for suite in ("ncap2023", "ncap2023-without-target"):
        avoided = {"CCRs/v20": True, "CCRs/v40": False, "CCCscp/v20/target20": True}
        rows = [threat_row(case=f"{suite}/{case}", avoided=avoided[case], **values) for case in avoided]
        runs.append(StoredRun(replace(config, suite=suite), rows, False))
    for row in runs[1].rows:
        row["false_activation"] = "CCCscp" in row["case"]
    runs[0].rows.append(threat_row("no-brake", f"{config.suite}/CCRs/v20", avoided=False, **values))
    script = load("detections")
    crossing, standing, together = script.lines(["a"], *runs)
    assert (crossing[1], standing[1], together[1]) == ("CCCscp", "CCRs", "all")
    assert crossing[2].startswith("0/1 [")
    assert crossing[2].endswith("] (1)")
    assert standing[2].startswith("1/2 [")
    assert standing[2].endswith("] (1)")
    assert together[2].startswith("1/3 [")
    assert together[2].endswith("] (2)")
    with pytest.raises(ValueError, match="the run of ncap2023 has no agent 'b'; it has no-brake, a"):
        script.lines(["b"], *runs)

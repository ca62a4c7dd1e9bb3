"""What commands accept: several suites, camera files, rates of agents, and parameters of OpenSCENARIO."""

import json
from pathlib import Path

import pytest
from support.runs import SMALL_SUITE

from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.cli import main as cli
from lgmd_gym.cli.values import find_target, read_camera
from lgmd_gym.openscenario import read

OPTIONS = ["--seeds", "1", "--jobs", "1", "--no-plots", "--no-report"]
AGENT = """
class Slow:
    fps = 15

    def act(self, observation, info):
        return 0.0
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    Path("small.toml").write_text(SMALL_SUITE)
    Path("slow_agent.py").write_text(AGENT)
    return tmp_path


def test_several_suites_have_a_folder_each(folder, capsys):
    """A name is a run of its own; files are one run."""
    options = [*OPTIONS, "--agents", "no-brake", "--out", "out", "--worlds", "0"]
    assert cli.run(["bench", "--suite", "r152", "small.toml", *options]) == 0
    assert sorted(path.name for path in Path("out").iterdir()) == ["r152", "small"]
    rows = Path("out/r152/episodes.jsonl").read_text().splitlines()
    assert len(rows) == 6
    printed = capsys.readouterr().out
    assert printed.index("run folder: out/r152") < printed.index("run folder: out/small")
    Path("out/r152/episodes.jsonl").write_text("\n".join(rows[:4]) + "\n")
    assert cli.run(["bench", "--resume", "out", "--no-plots", "--no-report"]) == 0
    assert "r152: resuming with 4 of 6 episodes" in capsys.readouterr().out
    assert len(Path("out/r152/episodes.jsonl").read_text().splitlines()) == 6


def test_a_suite_that_is_refused_leaves_no_folder(folder, capsys):
    options = ["--agents", "last-moment-oracle", "--out", "out"]
    assert cli.run(["bench", "--suite", "quick", "traffic", *options]) == 2
    assert "requires braking environments, got suite traffic" in capsys.readouterr().err
    assert not Path("out").exists()


def test_an_interruption_names_the_folder_of_all_suites(folder, capsys, monkeypatch):
    def play(run, progress):
        run.stop_reason = "interrupted"
        run.folder.close()
        return False

    monkeypatch.setattr(Run, "play", play)
    assert cli.run(["bench", "--suite", "quick", "r152", *OPTIONS, "--out", "out"]) == 130
    assert "all suites: lgmd-gym bench --resume out\n" in capsys.readouterr().out


def test_a_camera_file_has_the_fields_of_a_camera(folder):
    Path("mine.toml").write_text("hfov_deg = 20.0\nmount = { height_m = 1.4 }\n")
    camera = read_camera("mine.toml")
    assert camera == {"name": "mine", "hfov_deg": 20.0, "mount": {"height_m": 1.4}}
    (channel,) = RunConfig(camera=camera).sensor_config.channels
    assert (channel.name, channel.camera.hfov_deg, channel.camera.mount.height_m) == ("mine", 20.0, 1.4)
    assert read_camera("tele") == "tele"
    assert read_camera(None) is None


def test_a_camera_file_may_have_several_channels(folder):
    Path("two.toml").write_text('[[camera]]\ncamera = "tele"\nneuron = "dsn"\n[[camera]]\nname = "b"\n')
    first, second = RunConfig(camera=read_camera("two.toml")).sensor_config.channels
    assert (first.name, first.neuron, second.name, second.neuron) == ("tele", "dsn", "b", "lgmd")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("hfov = 3", "camera file 'mine.toml': unknown camera field 'hfov'; did you mean 'hfov_deg'?"),
        ("fps = 15", "camera file 'mine.toml': unknown camera field 'fps'; known: gaze"),
        ("[[camera]]\nhfov_deg = 0.0", "hfov_deg must be in (1, 170)"),
        ("fov = 1\n[[camera]]\nname = 'a'", "unknown key of a file with [[camera]] tables 'fov'"),
    ],
)
def test_faults_of_a_camera_file_are_one_line(folder, capsys, text, message):
    Path("mine.toml").write_text(text)
    assert cli.run(["drive", "LGMD/CCRs-v0", "--camera", "mine.toml"]) == 2
    assert message in capsys.readouterr().err


def test_a_rate_of_an_agent_is_that_of_its_camera(folder):
    options = [*OPTIONS, "--agents", "slow_agent:Slow", "always-brake", "--worlds", "0", "--out", "out"]
    assert cli.run(["bench", "--suite", "small.toml", *options]) == 0
    rows = map(json.loads, Path("out/episodes.jsonl").read_text().splitlines())
    assert {row["agent"]: row["fps"] for row in rows} == {
        "no-brake": 30.0,
        "slow_agent:Slow": 15.0,
        "always-brake": 30.0,
    }


@pytest.mark.parametrize(
    ("fps", "message"), [("13", "fps must divide simulation_frequency 60 Hz, got 13"), ("-1", "fps must be")]
)
def test_a_rate_that_cannot_be_is_refused(folder, capsys, fps, message):
    module = f"rate_{len(fps)}_{fps[-1]}"
    Path(f"{module}.py").write_text(AGENT.replace("15", fps))
    assert cli.run(["bench", "--suite", "small.toml", "--agents", f"{module}:Slow"]) == 2
    assert message in capsys.readouterr().err


def test_traffic_has_30_frames_per_second(folder, capsys):
    assert cli.run(["bench", "--suite", "traffic", "--agents", "slow_agent:Slow"]) == 2
    assert "agent slow_agent:Slow has fps 15, but the cameras of suite traffic" in capsys.readouterr().err


def test_export_accepts_what_show_accepts(folder):
    Path("sweep.toml").write_text(
        'name = "s"\n[[cases]]\nfamily = "CutIn"\nsweep = { ego_speed = [13.0, 20.0], gap = [8.0, 14.0] }\n'
    )
    assert cli.run(["scenario", "export", "sweep.toml", "--case", "CutIn/v72/gap8m", "--to", "a.xosc"]) == 0
    ((case,), original) = read("a.xosc").cases, find_target("sweep.toml", "CutIn/v72/gap8m", None, False)[0]
    assert case.scenario.ego_speed == original.scenario.ego_speed == 20.0
    assert case.scenario.actors[0].gap == pytest.approx(original.scenario.actors[0].gap)
    given = ["--set", "ego_speed=9", "weather=night", "--to", "b.xosc"]
    assert cli.run(["scenario", "export", "LGMD/CCRs-v0", *given]) == 0
    (case,) = read("b.xosc").cases
    assert (case.family, case.scenario.ego_speed, case.argument("weather")) == ("CCRs", 9.0, "night")


def test_set_gives_the_parameters_of_an_openscenario_file(folder, capsys):
    assert cli.run(["scenario", "export", "LGMD/CCRs-v0", "--set", "ego_speed=7.5", "--to", "a.xosc"]) == 0
    text, speed = Path("a.xosc").read_text(), '<AbsoluteTargetSpeed value="7.5" />'
    assert text.count(speed) == 1
    declared = '<ParameterDeclaration name="v" parameterType="double" value="8"/></ParameterDeclarations>'
    text = text.replace(speed, speed.replace("7.5", "$v")).replace("</ParameterDeclarations>", declared)
    Path("a.xosc").write_text(text)
    assert find_target("a.xosc", None, None, False)[0].scenario.ego_speed == 8.0
    target, arguments = find_target("a.xosc", None, None, False, ("v=12.5", "weather=fog"))
    assert (target.scenario.ego_speed, arguments) == (12.5, {"weather": "fog"})
    capsys.readouterr()
    assert cli.run(["scenario", "show", "a.xosc", "--set", "w=3"]) == 2
    assert "unknown parameter 'w'; known: Scenario_ID, v" in capsys.readouterr().err
    assert cli.run(["drive", "a.xosc", "--set", "v=fast"]) == 2
    assert "parameter v of type double must be a number, got 'fast'" in capsys.readouterr().err

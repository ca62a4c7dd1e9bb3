"""Commands that play an episode again, and frames with the fields of an agent."""

import base64
import io

import gymnasium as gym
import numpy as np
import pytest
from PIL import Image
from support.rows import threat_row

import lgmd_gym  # noqa: F401  (registers the ids)
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.neuron import registry
from lgmd_gym.report.frames import WIDE, frame_uri
from lgmd_gym.report.sections import ReportData, own_signal


def replay(case, suite="quick", world=8003, **config):
    chosen = RunConfig(suite=suite, **config)
    data = ReportData("", chosen, {}, chosen.get_suite(), [], [], False)
    return data.replay(threat_row("spike-threshold:threshold=45", case, 2, world=world, condition="rain"))


def test_the_command_repeats_seed_world_and_weather():
    start = "lgmd-gym drive quick/CCRs/v30 --agent spike-threshold:threshold=45 --seed 2 --world"
    assert replay("quick/CCRs/v30") == f"{start} 8003 --condition rain"
    assert replay("quick/CCRs/v30", world=None) == f"{start} laboratory --condition rain"
    assert replay("quick/CCRs/v30", camera="tele").endswith(" --condition rain --camera tele")
    assert replay("quick/CCRs/v30", neuron="off-only").endswith(" --condition rain --neuron off-only")


def test_a_level_has_a_world_and_a_weather_of_its_own():
    case = "random/" + RunConfig(suite="random").get_suite().cases[0].name.partition("/")[2]
    assert replay(case, "random").endswith(" --seed 2")


def test_an_own_suite_is_the_copy_in_the_run_folder(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('name = "mine"\n[[cases]]\nfamily = "CCRs"\nspeeds_kmh = [30]\n')
    assert "drive suite.toml --case mine/CCRs/v30 --agent" in replay("mine/CCRs/v30", str(path))


def test_the_page_states_where_the_commands_run(tmp_path):
    def place(suite, agents=("spike-threshold",), neuron=None):
        config = RunConfig(suite=suite, agents=agents, neuron=neuron)
        return ReportData("", config, {}, config.get_suite(), [], list(agents), False).replay_place

    path = tmp_path / "mine.toml"
    path.write_text('name = "mine"\n[[cases]]\nfamily = "CCRs"\nspeeds_kmh = [30]\n')
    assert place("quick") == "in any folder"
    assert place("quick", ("my_agent:Mine",)) == "in the folder of your modules"
    assert place("quick", neuron="off-only:t_sp=0.78") == "in any folder"
    assert place(str(path)) == "in the run folder"
    own = place(str(path), ("my_agent:Mine",))
    assert own == "in the run folder, with the folder of your modules in PYTHONPATH"


def test_the_signal_of_an_own_neuron_is_named_whether_or_not_it_is_loaded(monkeypatch):
    def signal(neuron):
        return own_signal(RunConfig(suite="quick", neuron=neuron))

    assert signal(None) == signal("off-only") == signal("off-only:t_sp=0.78") == ""
    neuron = "my_neuron:Mine:sigma=2"
    assert signal(neuron) == neuron
    monkeypatch.setitem(registry._MODELS, "my_neuron:Mine", registry._MODELS["difference"])
    assert signal(neuron) == neuron


@pytest.mark.parametrize(
    "config", [{"road": "rough"}, {"params": {"t_sf": 20.0}}, {"camera": {"hfov_deg": 20.0}}]
)
def test_settings_without_an_option_of_the_command_have_none(config):
    assert replay("quick/CCRs/v30", **config) == ""


def test_a_frame_shows_the_field_of_the_camera():
    env = gym.make("LGMD/CCRs-v0", camera="fovea", world="laboratory")
    env.reset(seed=0)
    kind, data = frame_uri(env).split(",")
    assert kind == "data:image/jpeg;base64"
    picture = np.array(Image.open(io.BytesIO(base64.b64decode(data)))).astype(int)
    assert picture.shape == (*WIDE.shape, 3)
    orange = picture[..., 0] - picture[..., 2] > 60
    rows, columns = np.nonzero(orange)
    # 160 x 90 px over 10 degrees, in a frame of 320 px over 60 degrees: tan 5 / tan 30 = 0.1515 of it.
    assert columns.max() - columns.min() == pytest.approx(0.1515 * 320, abs=2.5)
    assert rows.max() - rows.min() == pytest.approx(0.1515 * 180, abs=2.5)
    assert not orange[rows.min() + 4 : rows.max() - 3, columns.min() + 4 : columns.max() - 3].any()


def test_a_top_view_has_no_fields():
    env = gym.make("LGMD/CCRs-v0", camera="birdseye")
    env.reset(seed=0)
    data = base64.b64decode(frame_uri(env).split(",")[1])
    assert Image.open(io.BytesIO(data)).mode == "L"

"""The command that installs an extra works for the installation at hand."""

import json
import sys
import zipfile

import pytest

from lgmd_gym.agents.policies.card import CARD
from lgmd_gym.cli import main as cli
from lgmd_gym.processes import extras


class Installed:
    def __init__(self, source):
        self.source = source

    def read_text(self, name):
        assert name == "direct_url.json"
        return None if self.source is None else json.dumps(self.source)


@pytest.fixture
def clone(tmp_path):
    (tmp_path / "pyproject.toml").touch()
    return tmp_path


def install(monkeypatch, *sources):
    monkeypatch.setattr(extras, "distributions", lambda name: [Installed(source) for source in sources])


def test_an_editable_installation_names_its_clone(clone, monkeypatch):
    install(monkeypatch, None, {"url": clone.as_uri(), "dir_info": {"editable": True}})
    assert extras.install_command("train") == f'pip install -e "{clone}[train]"'
    monkeypatch.chdir(clone)
    assert extras.install_command("train") == 'pip install -e ".[train]"'


def test_other_installations(clone, tmp_path, monkeypatch):
    install(monkeypatch, {"url": clone.as_uri(), "dir_info": {}})
    assert extras.install_command("flow") == f'pip install "{clone}[flow]"'
    gone = {"url": (tmp_path / "gone").as_uri(), "dir_info": {"editable": True}}
    wheel = {"url": "file:///x/lgmd_gym.whl", "archive_info": {}}
    for source in (None, gone, wheel):
        install(monkeypatch, source)
        assert extras.install_command("flow") == 'pip install "lgmd-gym[flow]"'


@pytest.mark.parametrize(("arguments", "module", "extra"), [
    (["train"], "tensorboard", "train"),
    (["tune"], "optuna", "train"),
    (["bench", "--agents", "policy:pickled.zip"], "stable_baselines3", "train"),
    (["drive", "LGMD/CCRs-v0", "--agent", "flow-divergence"], "cv2", "flow"),
    (["bench", "--backend", "dask", "--address", "tcp://x:1"], "distributed", "cluster"),
])  # fmt: skip
def test_commands_state_how_to_install_what_is_missing(
    arguments, module, extra, clone, monkeypatch, capsys, tmp_path
):
    install(monkeypatch, {"url": clone.as_uri(), "dir_info": {"editable": True}})
    monkeypatch.chdir(tmp_path)
    with zipfile.ZipFile("pickled.zip", "w") as policy:
        policy.writestr(CARD, '{"algo": "ppo", "camera": "fovea"}')
    for name in [name for name in sys.modules if name.partition(".")[0] == module]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)
    assert cli.run(arguments) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert message.endswith(f'requires the extra "{extra}": pip install -e ".[{extra}]"\n')


def test_train_checks_its_extra_before_it_loads_the_modules_of_it(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    monkeypatch.setitem(sys.modules, "lgmd_gym.training", None)
    assert cli.run(["train"]) == 2
    assert 'training requires the extra "train"' in capsys.readouterr().err

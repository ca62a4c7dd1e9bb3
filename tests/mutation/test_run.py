"""The mutation test itself: what is left of it after a signal."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from mutation.modules import MODULES

RUN = Path(__file__).parent / "run.py"


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_with_the_score_so_far_and_leaves_no_copy(tmp_path, number):
    copies, out = tmp_path / "copies", tmp_path / "out.jsonl"
    copies.mkdir()
    command = [sys.executable, str(RUN), "neuron", "--out", str(out)]
    environment = os.environ | {"TMPDIR": str(copies)}
    process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
    while not (out.exists() and out.read_text().count("\n")) and process.poll() is None:
        time.sleep(0.1)
    process.send_signal(number)
    output = process.communicate(timeout=240)[0]
    assert process.returncode == 1
    assert " mutants played, " in output
    assert not [path for path in copies.iterdir() if path.name.startswith("lgmd-gym-mutants-")]


@pytest.mark.slow
@pytest.mark.parametrize("name", MODULES)
def test_the_tests_of_a_module_pass_without_compilation(name):
    """Or no mutant of the module could be played."""
    environment = os.environ | {
        "NUMBA_DISABLE_JIT": "1",
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
        "PYTEST_ADDOPTS": "",
    }
    options = ["-q", "-o", "addopts=--import-mode=importlib", "--noconftest", "--tb=line"]
    command = [sys.executable, "-m", "pytest", *options, *MODULES[name].tests]
    ended = subprocess.run(command, env=environment, cwd=RUN.parents[2], capture_output=True, text=True)
    assert ended.returncode == 0, ended.stdout

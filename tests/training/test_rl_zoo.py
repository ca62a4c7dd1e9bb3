"""rl_zoo3 trains on the environments, with the versions of constraints.txt."""

import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
HYPERPARAMETERS = {"n_timesteps": 256, "policy": "MultiInputPolicy", "n_steps": 128, "batch_size": 64}
ENV = "LGMD/RandomBraking-v0"


@pytest.fixture
def zoo_python(tmp_path):
    """Return the Python of an environment with rl_zoo3 in addition to the packages of this one."""
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "zoo"], check=True)
    packages = next((tmp_path / "zoo").rglob("site-packages"))
    (packages / "shared.pth").write_text(f"import site; site.addsitedir({sysconfig.get_path('purelib')!r})\n")
    python = packages.parents[2 if sys.platform != "win32" else 1]
    python = python / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    install = [python, "-m", "pip", "install", "-q", "-c", ROOT / "constraints.txt", "rl_zoo3"]
    done = subprocess.run(install, capture_output=True, text=True)
    if "Failed to establish a new connection" in done.stderr or "No matching distribution" in done.stderr:
        pytest.skip("no package index")
    assert done.returncode == 0, done.stderr
    return python


@pytest.mark.slow
def test_rl_zoo3_trains_a_policy(zoo_python, tmp_path):
    (tmp_path / "ppo.yml").write_text(yaml.safe_dump({ENV: HYPERPARAMETERS}))
    command = [zoo_python, "-m", "rl_zoo3.train", "--algo", "ppo", "--env", ENV, "--gym-packages", "lgmd_gym"]
    command += ["--conf-file", "ppo.yml", "--log-folder", "logs", "--eval-freq", "-1", "--seed", "0"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "logs" / "ppo" / "LGMD-RandomBraking-v0_1"
    assert (folder / "LGMD-RandomBraking-v0.zip").is_file()
    rows = (folder / "0.monitor.csv").read_text().splitlines()
    assert rows[1] == "r,l,t"
    assert "total_timesteps      | 256" in done.stdout

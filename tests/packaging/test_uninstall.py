"""The documented command removes what `pip uninstall` leaves."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def documented_command():
    page = (ROOT / "docs" / "getting_started.md").read_text()
    return re.search(r"^\.venv/bin/python -I -c .*$", page, re.MULTILINE)[0]


def test_the_documented_command_removes_compiled_kernels_and_spares_a_clone(tmp_path):
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / ".venv"], check=True)
    packages = next((tmp_path / ".venv").rglob("site-packages"))
    installed = packages / "lgmd_gym" / "neuron" / "__pycache__" / "step.py311.nbi"
    cloned = tmp_path / "lgmd_gym" / "__init__.py"
    for file in (installed, cloned, packages / "other" / "__init__.py"):
        file.parent.mkdir(parents=True)
        file.touch()
    for _ in range(2):  # without a folder, it does nothing
        done = subprocess.run(
            ["bash", "-c", documented_command()], cwd=tmp_path, capture_output=True, text=True
        )
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert [path.name for path in packages.iterdir()] == ["other"]
    assert cloned.exists()

"""`import lgmd_gym` registers environments and does nothing else."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
STATE = """
import gymnasium, json, os, signal, sys, threading
def state():
    numbers = signal.valid_signals()
    return [
        {str(number): str(signal.getsignal(number)) for number in numbers},
        dict(os.environ), sys.unraisablehook.__name__, sys.excepthook.__name__, threading.active_count(),
    ]
before = state()
import lgmd_gym
print(json.dumps([before, state(), list(lgmd_gym.__path__), len(gymnasium.registry), list(sys.modules)]))
"""
HEAVY = ("torch", "pandas", "matplotlib", "cv2", "highway_env", "numba", "llvmlite", "stable_baselines3")
NAMES = "import lgmd_gym.envs as e, lgmd_gym.agents.registry as a; print(e.__file__, a.__file__, sep='\\n')"


@pytest.fixture(scope="module")
def imported(tmp_path_factory):
    """State before and after the import, path, number of ids, modules, and files that a new process wrote."""
    home = tmp_path_factory.mktemp("home")
    folders = {name: str(home / name) for name in ("TMPDIR", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR")}
    (home / "TMPDIR").mkdir()
    env = {**os.environ, **folders, "HOME": str(home), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run([sys.executable, "-c", STATE], env=env, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return *json.loads(done.stdout), [path for path in home.rglob("*") if path != home / "TMPDIR"]


def test_no_signal_handler_variable_hook_or_thread_changes(imported):
    before, after, *_ = imported
    assert after == before


def test_the_path_of_the_package_is_its_folder(imported):
    assert imported[2] == [str(ROOT / "lgmd_gym")]


def test_no_file_is_written(imported):
    assert imported[-1] == []


def test_no_heavy_package_is_loaded(imported):
    assert [name for name in HEAVY if name in imported[4]] == []
    kernels = [name for name in imported[4] if name.startswith(("lgmd_gym.kernels", "lgmd_gym.processes"))]
    assert kernels == []


def test_the_ids_are_registered(imported):
    assert imported[3] > 50


def test_a_clone_without_links_imports(tmp_path):
    """Git writes the links as text files on Windows."""
    without = shutil.ignore_patterns("__pycache__")
    for folder in ("envs", "agents"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=without)
    without = shutil.ignore_patterns("__pycache__", "envs", "agents")
    shutil.copytree(ROOT / "lgmd_gym", tmp_path / "lgmd_gym", ignore=without)
    for folder in ("envs", "agents"):
        (tmp_path / "lgmd_gym" / folder).write_text(f"../{folder}")
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    run = subprocess.run([sys.executable, "-c", NAMES], capture_output=True, text=True, cwd="/", env=env)
    expected = [str(tmp_path / "envs/__init__.py"), str(tmp_path / "agents/registry.py")]
    assert run.stdout.splitlines() == expected, run.stderr

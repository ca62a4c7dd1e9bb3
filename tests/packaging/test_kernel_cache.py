"""The folder of compiled kernels when neither the installation nor the user's cache is writable."""

import os
import sys
from pathlib import Path

import pytest

from lgmd_gym.kernels.kernel_cache import VARIABLE, ensure_kernel_cache

NOWHERE = Path("/proc/nowhere")


@pytest.fixture
def unwritable(tmp_path, monkeypatch):
    """No folder but the temporary one is writable; numba's settings are left alone."""
    monkeypatch.setenv(VARIABLE, "")  # restored after the test
    monkeypatch.setenv("XDG_CACHE_HOME", str(NOWHERE))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.delitem(sys.modules, "numba", raising=False)
    return tmp_path


def cache_folder(package):
    ensure_kernel_cache(package)
    return os.environ[VARIABLE]


def test_a_temporary_folder_is_the_last_resort(unwritable, tmp_path, capsys):
    expected = str(tmp_path / f"lgmd-gym-numba-{os.getuid()}")
    assert cache_folder(NOWHERE) == expected
    assert os.stat(expected).st_mode & 0o777 == 0o700
    printed = capsys.readouterr().err
    assert printed.startswith(f"lgmd-gym: numba stores compiled kernels in {expected}, because")
    assert printed.count("\n") == 1
    assert cache_folder(NOWHERE) == expected  # a worker inherits the folder and is silent
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("writable", ["package", "user", "variable"])
def test_a_writable_folder_is_kept(unwritable, writable, tmp_path, monkeypatch, capsys):
    if writable == "user":
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "new"))
    if writable == "variable":
        monkeypatch.setenv(VARIABLE, str(tmp_path / "own"))
    package = tmp_path if writable == "package" else NOWHERE
    assert cache_folder(package) == (str(tmp_path / "own") if writable == "variable" else "")
    assert capsys.readouterr().err == ""


def test_a_folder_prepared_by_somebody_else_is_not_used(unwritable, tmp_path):
    (tmp_path / f"lgmd-gym-numba-{os.getuid()}").symlink_to(tmp_path)
    folder = cache_folder(NOWHERE)
    assert os.path.dirname(folder) == str(tmp_path)
    assert not os.path.islink(folder)

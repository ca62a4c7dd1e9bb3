"""The folder of compiled kernels when neither the installation nor the user's cache is writable."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core import config

from lgmd_gym.kernels.cache_folder import use_temporary_folder

# The kernel is in a file whose folder is never writable.
CALL = """
from lgmd_gym.kernels import kernel
exec(compile("def twice(x):\\n return 2 * x", "/proc/self/cmdline", "exec"))
compiled = kernel(twice)
assert compiled(2) == 4
print(compiled.stats.cache_path, len(compiled.stats.cache_hits))
"""


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr(config, "CACHE_DIR", "")
    return tmp_path / f"lgmd-gym-numba-{os.getuid()}"


def test_the_folder_belongs_to_the_user_and_is_shared(temporary, capsys):
    for _ in range(2):
        use_temporary_folder()
        assert str(temporary) == config.CACHE_DIR
        assert os.stat(temporary).st_mode & 0o777 == 0o700
        printed = capsys.readouterr().err
        assert printed.startswith(f"lgmd-gym: numba stores compiled kernels in {temporary}, because")
        assert printed.count("\n") == 1


def test_a_folder_prepared_by_another_user_is_not_used(temporary, tmp_path):
    temporary.symlink_to(tmp_path)
    use_temporary_folder()
    assert os.path.dirname(config.CACHE_DIR) == str(tmp_path)
    assert not os.path.islink(config.CACHE_DIR)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="requires /proc")
@pytest.mark.parametrize("writable", ["user", "variable", ""])
def test_it_is_the_last_resort_of_every_process(writable, tmp_path):
    env = {**os.environ, "TMPDIR": str(tmp_path), "XDG_CACHE_HOME": "/proc/nowhere", "NUMBA_CACHE_DIR": ""}
    expected = tmp_path / f"lgmd-gym-numba-{os.getuid()}"
    if writable:
        expected = tmp_path / "own"
        env["XDG_CACHE_HOME" if writable == "user" else "NUMBA_CACHE_DIR"] = str(expected)
    for hits in (0, 1):
        done = subprocess.run(
            [sys.executable, "-c", CALL], cwd=tmp_path, env=env, capture_output=True, text=True
        )
        folder, found = done.stdout.split()
        assert Path(folder).is_relative_to(expected)
        assert int(found) == hits
        assert ("numba stores compiled kernels" in done.stderr) == (not writable), done.stderr

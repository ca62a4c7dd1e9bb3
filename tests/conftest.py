"""Fixtures of several test files."""

import os

import pytest
from hypothesis import settings
from support.clips import install_moviepy, write_lossless

from lgmd_gym.paper.backgrounds import Plain, Screen
from lgmd_gym.paper.stimuli import Looming, stimulus_frames

# Without the progress of compilation, which tests of messages would count.
os.environ.setdefault("LGMD_GYM_QUIET", "1")
# A first example may include the compilation of a kernel.
settings.register_profile("compiled", deadline=None)
settings.load_profile("compiled")


def pytest_configure(config):
    """Compile the kernels before the processes of pytest-xdist start, which would both do so."""
    if config.getoption("numprocesses", None) and not hasattr(config, "workerinput"):
        from lgmd_gym.engine.first_use import compile_kernels

        compile_kernels()


@pytest.fixture(scope="session")
def looming():
    """Frames of a dark square with contact at 1.4 s, static from then on."""
    return list(stimulus_frames(Screen(shape=(48, 96), px_per_m=300.0), 2.0, Plain(), Looming(contact=1.4)))


@pytest.fixture(scope="session")
def clip(tmp_path_factory, looming):
    """A lossless clip of `looming`."""
    return write_lossless(tmp_path_factory.mktemp("clips") / "loom.mkv", looming)


@pytest.fixture
def moviepy(monkeypatch):
    """Let Gymnasium's `RecordVideo` write videos without moviepy."""
    install_moviepy(monkeypatch)

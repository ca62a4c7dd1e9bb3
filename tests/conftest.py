"""What several test files share."""

import pytest
from support.clips import store

from lgmd_gym.paper.stimuli import Looming, Plain, Screen, frames


@pytest.fixture(scope="session")
def looming():
    """A dark square that arrives at 1.4 s, held for a while."""
    return list(frames(Screen(shape=(48, 96), px_per_m=300.0), 2.0, Plain(), Looming(contact=1.4)))


@pytest.fixture(scope="session")
def clip(tmp_path_factory, looming):
    return store(tmp_path_factory.mktemp("clips") / "loom.mkv", looming)

"""Options of each command."""

from lgmd_gym.cli.options.bench import Bench
from lgmd_gym.cli.options.compare import Compare
from lgmd_gym.cli.options.doctor import Doctor
from lgmd_gym.cli.options.drive import Drive
from lgmd_gym.cli.options.gallery import Gallery
from lgmd_gym.cli.options.list import List
from lgmd_gym.cli.options.paper import Paper
from lgmd_gym.cli.options.scenario import Scenario
from lgmd_gym.cli.options.train import Train
from lgmd_gym.cli.options.tune import Tune
from lgmd_gym.cli.options.values import refuse_unused
from lgmd_gym.cli.options.video import Video

__all__ = [
    "Bench",
    "Compare",
    "Doctor",
    "Drive",
    "Gallery",
    "List",
    "Paper",
    "Scenario",
    "Train",
    "Tune",
    "Video",
    "refuse_unused",
]

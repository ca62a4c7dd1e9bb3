"""Gymnasium environments where a highway-env car brakes on the spike frequency of a locust looming neuron.

Importing this package registers the `LGMD/…` ids. Heavy modules are imported on first use of a name.
"""

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

# Git writes the links to envs and agents as text files where `core.symlinks` is false, as on Windows.
if not all(Path(__file__).with_name(link).is_dir() for link in ("envs", "agents")):
    __path__.append(str(Path(__file__).parents[1]))

from lgmd_gym._version import __version__
from lgmd_gym.envs.registration import register_envs, register_traffic

if TYPE_CHECKING:
    from lgmd_gym.camera import BirdsEye, Camera, EgoCamera, Mount, Scene, Weather
    from lgmd_gym.neuron import LGMD, LGMDParams, Response
    from lgmd_gym.rendering.view import LGMDView
    from lgmd_gym.sensing.channel import Channel
    from lgmd_gym.wrappers.observation import LGMDObservation

__all__ = [
    "LGMD",
    "BirdsEye",
    "Camera",
    "Channel",
    "EgoCamera",
    "LGMDObservation",
    "LGMDParams",
    "LGMDView",
    "Mount",
    "Response",
    "Scene",
    "Weather",
    "__version__",
]

_MODULES = {
    "LGMD": "neuron",
    "LGMDParams": "neuron",
    "Response": "neuron",
    "BirdsEye": "camera",
    "Camera": "camera",
    "Channel": "sensing.channel",
    "Mount": "camera",
    "Scene": "camera",
    "Weather": "camera",
    "EgoCamera": "camera",
    "LGMDObservation": "wrappers",
    "LGMDView": "rendering.view",
}

register_envs()
register_traffic()


def __getattr__(name: str) -> object:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)

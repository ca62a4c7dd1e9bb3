"""Camera and neuron of the agents under test: the user's choice, or each agent's own."""

from dataclasses import dataclass, replace

from lgmd_gym.agents import Agent, BatchAgent
from lgmd_gym.aliases import Arguments
from lgmd_gym.camera import BirdsEye
from lgmd_gym.neuron import NeuronSpec
from lgmd_gym.sensing.channel import Channel, ChannelSpec, make_channels, plain_values

DEFAULT_CAMERA = "fovea"


@dataclass(frozen=True, slots=True)
class SensorConfig:
    """Camera and neuron parameters."""

    # see `LGMDObservation`. None selects the agent's own camera (`Agent.camera`), or "fovea" for an agent
    # without one
    camera: ChannelSpec | None = None
    # see `LGMDObservation`. None selects the agent's own parameters if the camera is its own
    params: NeuronSpec = None
    include_frame: bool = False  # whether the frames are part of the observation
    # model of the cameras without one of their own, see `lgmd_gym.neuron.check_model`; None for the LGMD. The
    # result of `for_agent` has it in its cameras
    neuron: str | None = None
    fps: float | None = None  # camera frame rate [Hz]; None selects the agent's own, or 30

    def for_agent(self, agent: Agent | BatchAgent | None = None) -> "SensorConfig":
        """Return the config with the agent's own camera and parameters in place of None."""
        include_frame = self.include_frame or bool(getattr(agent, "include_frame", False))
        camera, params = self.camera, self.params
        if camera is None:
            camera = getattr(agent, "camera", None)
            params = getattr(agent, "neuron", None) if params is None else params
        camera = DEFAULT_CAMERA if camera is None else camera
        if self.neuron is not None:
            camera = plain_values(make_channels(camera, self.neuron))
        fps = getattr(agent, "fps", None) if self.fps is None else self.fps
        return SensorConfig(camera, params, include_frame, fps=fps)

    @property
    def plain(self) -> "SensorConfig":
        """The same config as plain values, for JSON and TOML."""
        return replace(self, camera=plain_values(self.camera), params=plain_values(self.params))

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels; those of the default camera for None."""
        return make_channels(DEFAULT_CAMERA if self.camera is None else self.camera)

    @property
    def has_top_view(self) -> bool:
        """Whether a camera is highway-env's top view, which shows no weather."""
        return any(isinstance(channel.camera, BirdsEye) for channel in self.channels)

    @property
    def arguments(self) -> Arguments:
        """Keyword arguments of `LGMDObservation`."""
        arguments: Arguments = {"camera": self.camera, "params": self.params}
        arguments |= {"include_frame": self.include_frame}
        return arguments if self.fps is None else arguments | {"fps": self.fps}

    @property
    def label(self) -> str:
        """Camera names for rows and titles, as in "fovea" or "zone8+upright8"."""
        if self.camera is None:
            return "each agent's own"
        return "+".join(channel.name for channel in self.channels)

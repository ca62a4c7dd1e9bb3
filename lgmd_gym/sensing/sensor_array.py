"""SensorArray: the cameras and neurons of one or more environments."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import gymnasium as gym
import numpy as np

from lgmd_gym import neuron as models
from lgmd_gym.camera import BirdsEye, Camera, EgoCamera
from lgmd_gym.camera.pose import USUAL_BRAKE
from lgmd_gym.camera.road_geometry import RoadGeometry
from lgmd_gym.camera.scene import Scene
from lgmd_gym.kernels.threads import Threads, check_compiling
from lgmd_gym.neuron import Layer, LGMDParams, Response
from lgmd_gym.sensing.channel import LGMD, Channel, ChannelSpec, make_channels
from lgmd_gym.sensing.drawing import Drawing
from lgmd_gym.sensing.kernels import NUMBERS, SIGNALS
from lgmd_gym.sensing.neurons import NeuronGroup

if TYPE_CHECKING:
    from highway_env.road.road import Road, RoadNetwork


class SensorArray:
    """Channels of one or more environments: cameras, each with its own neuron.

    A frame of an environment takes two steps. First its state is written: by `read` for a highway-env
    environment, or by a caller that fills `scenes`, `objects` and `object_counts` itself and calls `set_road`
    after a change of the road. Then `process` or `step` draws the frames and steps the neurons, in compiled
    code without the GIL; `responses` and `frames` hold the results.

    Args:
        camera: Channels of every environment, see `make_channels`.
        fps: Camera frame rate [Hz].
        params: Parameters of the neurons; of models other than the LGMD, those of adaptation and spikes.
        num_envs: Number of environments.
        threads: Number of threads of `step`; None for the calling thread only.
        neuron: Neuron of the channels without their own.

    Attributes:
        num_envs: Number of environments.
        channels: The channels.
        names: Their names.
        scenes: `SCENE` records, shape (num_envs,).
        objects: `OBJECT` records, shape (num_envs, 512): vehicles, obstacles and marks of each environment in
            the order of `road.vehicles`, then `road.objects`, without the ego and the roadside. Vehicles of
            any size are of `MODEL_CAR`; an obstacle with a grey of its own is of `MODEL_BOX`; pedestrians and
            two-wheelers have models of their own; `range` is `MAX_RANGE`.
        object_counts: Number of objects, int64, shape (num_envs,).
        enabled: Channels in use, bool, shape (num_envs, channels), initially all. A channel that is not
            enabled keeps its last outputs, and its neuron is reset before the first frame after a pause. Its
            camera is not drawn, unless an enabled channel has the same camera.
        responses: The last outputs of the neurons, arrays of shape (num_envs, channels), updated in place.
        signals: The `SIGNALS` among them, float64, shape (num_envs, 3, channels).
    """

    responses: Response

    def __init__(
        self,
        camera: ChannelSpec,
        fps: float,
        params: LGMDParams,
        num_envs: int = 1,
        threads: int | None = None,
        neuron: str = LGMD,
    ) -> None:
        check_compiling()
        self.num_envs, self.channels = num_envs, make_channels(camera, neuron)
        self.names = [channel.name for channel in self.channels]
        size = num_envs, len(self.names)
        self.enabled, self._stale = np.ones(size, np.bool_), np.zeros(size, np.bool_)
        self._all = np.ones(num_envs, np.bool_)
        self._numbers = np.zeros((num_envs, len(NUMBERS), len(self.names)))
        self._spikes, self._alerts = np.zeros(size, np.int64), np.zeros(size, np.bool_)
        self._threads = Threads(threads or 1)
        kinds: dict[tuple[tuple[int, int], str, int], list[int]] = {}
        for index, channel in enumerate(self.channels):
            kinds.setdefault((channel.camera.shape, channel.neuron, channel.columns), []).append(index)
        self._drawing = Drawing([channel.camera for channel in self.channels], list(kinds.values()), num_envs)
        self._neurons = [
            self._make_neurons(members, self._drawing.group_of[index], fps, params)
            for index, members in enumerate(kinds.values())
        ]
        # Neurons of each group of frames, and its channels to draw.
        self._users = [
            [
                group
                for group, used in zip(self._neurons, self._drawing.group_of, strict=True)
                if used == index
            ]
            for index in range(len(self._drawing.groups))
        ]
        self._drawn = [users[0].selected.copy() for users in self._users]
        # Index of each channel's group of neurons, and of the channel in that group.
        self._locations = [
            next((g, group.members.index(k)) for g, group in enumerate(self._neurons) if k in group.members)
            for k in range(len(self.names))
        ]
        self._link()
        self.reset()

    @property
    def shapes(self) -> list[tuple[int, int]]:
        """Frame shapes (height, width) of the channels [px]."""
        return [channel.camera.shape for channel in self.channels]

    @property
    def columns(self) -> list[int]:
        """Numbers of columns of the channels."""
        return [channel.columns for channel in self.channels]

    @property
    def known_decelerations(self) -> np.ndarray | None:
        """The car's estimate of its full braking in each environment, float64, shape (num_envs, 1) [m/s²].

        None unless a camera has `brake_known`.
        """
        return self._drawing.known_decelerations

    @property
    def frames(self) -> list[np.ndarray]:
        """The last frames, one array per frame shape, neuron and number of columns, uint8.

        Arrays have the shape (num_envs, channels of that kind, height, width); see `frame_of` and
        `stacked_frames`.
        """
        return [group.group.frames for group in self._neurons]

    @property
    def cameras(self) -> list[dict[str, EgoCamera | BirdsEye]]:
        """Per environment, the cameras by channel name, posed as in their last frames."""
        return [
            {name: self._drawing.camera_of(k, index) for k, name in enumerate(self.names)}
            for index in range(self.num_envs)
        ]

    def read(self, env: gym.Env, index: int = 0) -> None:
        """Read the present state of a highway-env environment, and render its top views.

        Args:
            env: The environment, wrapped or not, after its first reset.
            index: Index of the environment.

        Raises:
            ValueError: If the environment has no road or ego yet, or a pose is not finite.
        """
        self._drawing.read(env, index)
        self.read_top_views(env, index)

    @property
    def has_top_views(self) -> bool:
        """Whether highway-env draws one of the cameras."""
        return bool(self.top_views)

    @property
    def top_views(self) -> list[int]:
        """Indices of the channels whose camera highway-env draws."""
        return [k for k, channel in enumerate(self.channels) if isinstance(channel.camera, BirdsEye)]

    def read_top_views(self, env: gym.Env, index: int = 0) -> None:
        """Render the enabled cameras of environment `index` that highway-env draws."""
        self._drawing.render_top_views(env, index, self.enabled[index])

    def set_road(self, index: int, road: "Road | RoadNetwork", geometry: RoadGeometry | None = None) -> None:
        """Set the road of environment `index`.

        A call with the same network as before returns at once: a network must not change. One thread at a
        time may call this method and `set_scene`, also while others process other environments.

        Args:
            index: Index of the environment.
            road: A highway-env `Road` or `RoadNetwork`.
            geometry: Its geometry in the scene, if it is known, see `scene_geometry`.
        """
        self._drawing.set_road(index, road, geometry)

    def set_scene(
        self, index: int, scene: Scene | Mapping[str, object] | None, max_deceleration: float = USUAL_BRAKE
    ) -> None:
        """Set the scene of environment `index`.

        What changes the road, such as the world, applies with the next `set_road` or `read`: it may not fit
        the road of the last episode.

        Args:
            index: Index of the environment.
            scene: The scene, or some of its fields; None for the laboratory.
            max_deceleration: Full braking of the car [m/s²].

        Raises:
            ValueError: If a field is unknown or out of range, or a camera does not fit the scene.
        """
        self._drawing.set_scene(index, Scene.make(scene), max_deceleration)

    def process(self, first: int, last: int, active: np.ndarray | None = None) -> None:
        """Draw and process one frame of every enabled channel of the environments first..last-1.

        Threads may process disjoint ranges at once.

        Args:
            first: First environment.
            last: Last environment + 1.
            active: Selection of the environments with a new frame, bool, shape (num_envs,); None for all. The
                others keep their frames and outputs.
        """
        active = self._all if active is None else active
        for index, users in enumerate(self._users):
            chosen = [group for group in users if group.select(first, last, active)]
            if chosen:
                drawn = chosen[0].selected
                if len(chosen) > 1:
                    drawn = self._drawn[index]
                    drawn[first:last] = np.any([group.selected[first:last] for group in chosen], axis=0)
                self._drawing.draw(index, first, last, drawn)
            for group in chosen:
                group.step(first, last)

    def step(self, active: np.ndarray | None = None) -> None:
        """Process all environments like `process`, on `threads` threads."""
        if self._threads.count == 1:
            self.process(0, self.num_envs, active)
        else:
            self._threads.run(self.process, self.num_envs, (active,))

    def reset(self, mask: np.ndarray | None = None) -> None:
        """Reset the neurons of selected environments, bool, shape (num_envs,); None for all.

        Threads may reset disjoint selections at once.
        """
        mask = self._all if mask is None else mask
        self._stale[mask] = False
        for group in self._neurons:
            group.reset(mask)

    def frame_of(self, channel: int, index: int = 0) -> np.ndarray:
        """Return a view of the last frame of one channel of environment `index`, uint8, (height, width)."""
        return self._drawing.frame_of(channel, index)

    def stacked_frames(self) -> np.ndarray:
        """Return the last frames of channels with one shape, uint8, (num_envs, channels, height, width).

        A view if all channels have the same neuron and number of columns, else a new array.
        """
        if len(self._neurons) == 1:
            return self._neurons[0].group.frames
        return np.stack([self._neurons[g].group.frames[:, row] for g, row in self._locations], axis=1)

    def column_potentials(self) -> np.ndarray:
        """Return the last potentials of the columns of all channels, new array, (num_envs, columns)."""
        return np.concatenate([self._neurons[g].columns[:, row] for g, row in self._locations], axis=1)

    def response_of(self, index: int = 0) -> Response:
        """Return a copy of the last outputs of environment `index`, arrays of shape (channels,)."""
        return Response(*(field[index].copy() for field in self.responses))

    def layers(self, channel: int = 0) -> dict[str, np.ndarray]:
        """Return the layer maps of one channel's last frame in the first environment."""
        group, row = self._locations[channel]
        return {name: maps[row] for name, maps in self._neurons[group].neuron.layers.items()}

    def shown_layers(self, channel: int = 0) -> Mapping[str, Layer]:
        """Return those of `layers` that pictures show."""
        return self._neurons[self._locations[channel][0]].neuron.shown_layers

    def bounds(self, signal: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper bounds of an output of each channel, float32, shape (channels,)."""
        declared = [self._neurons[group].neuron.signals[signal] for group, _ in self._locations]
        low, high = zip(*((item.low, item.high) for item in declared), strict=True)
        return np.array(low, np.float32), np.array(high, np.float32)

    def close(self) -> None:
        """Close the cameras that hold resources."""
        self._drawing.close()

    def _make_neurons(self, members: list[int], group: int, fps: float, params: LGMDParams) -> NeuronGroup:
        """Return the neurons of channels with one frame size, one model and one number of columns."""
        first, frames = self.channels[members[0]], self._drawing.groups[group]
        derotated = any(_is_derotated(self.channels[k]) for k in members)
        neurons = models.make(
            first.neuron,
            first.camera.shape,
            fps,
            self.num_envs * len(members),
            params,
            columns=first.columns,
            derotated=derotated,
        )
        outputs = self._numbers, self._spikes, self._alerts
        return NeuronGroup(
            neurons, members, frames, self.enabled, self._stale, outputs, first.columns, derotated
        )

    def _link(self) -> None:
        """Bind views of arrays owned by other objects."""
        table = self._drawing.scene_table
        self.scenes, self.objects, self.object_counts = table.scenes, table.objects, table.object_counts
        self.signals = self._numbers[:, : len(SIGNALS)]
        fields = {name: self._numbers[:, field] for field, name in enumerate(NUMBERS)}
        self.responses = Response(**fields, spikes=self._spikes, alert=self._alerts)

    def __getstate__(self) -> dict[str, object]:
        linked = ("scenes", "objects", "object_counts", "responses", "signals")
        return {name: value for name, value in self.__dict__.items() if name not in linked}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self._link()


def _is_derotated(channel: Channel) -> bool:
    return isinstance(channel.camera, Camera) and bool(channel.camera.gaze.derotated)

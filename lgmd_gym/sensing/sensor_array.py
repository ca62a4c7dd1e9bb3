"""SensorArray: the cameras and neurons of one or more environments."""

from collections.abc import Mapping
from dataclasses import replace
from threading import Lock
from typing import Any

import gymnasium as gym
import numpy as np

from lgmd_gym import neuron
from lgmd_gym.camera import BirdsEye, CameraParams, CameraSpec, EgoCamera
from lgmd_gym.camera.road_pool import RoadPool
from lgmd_gym.camera.scene_table import SceneTable
from lgmd_gym.kernels.threads import Threads
from lgmd_gym.neuron import Layer, LGMDParams, Response
from lgmd_gym.sensing.cameras import Variant, Variants, make_cameras
from lgmd_gym.sensing.kernels import NUMBERS, SIGNALS
from lgmd_gym.sensing.sensor_group import SensorGroup

_separation = Lock()


class SensorArray:
    """Cameras of one or more environments, each with its own neuron.

    A frame of an environment takes two steps. First its state is written: by `read` for a highway-env
    environment, or by a caller that fills `scenes`, `objects` and `object_counts` itself and calls `set_road`
    after a change of the road. Then `process` or `step` draws the frames and steps the neurons, in compiled
    code without the GIL; `responses` and `frames` hold the results.

    Args:
        camera: Cameras of every environment, see `make_cameras`.
        fps: Camera frame rate [Hz].
        params: Parameters of the neurons.
        num_envs: Number of environments.
        threads: Number of threads of `step`; None for the calling thread only.

    Attributes:
        num_envs: Number of environments.
        names: Names of the cameras.
        shapes: Frame shapes (height, width) of the cameras [px].
        detectors: Detectors of the cameras, see `CameraParams`.
        columns: Numbers of columns of the cameras, see `CameraParams`.
        known_decelerations: The car's estimate of its full braking in each environment, float64, shape
            (num_envs, 1) [m/s²]; None unless a camera has `brake_known`.
        scenes: `SCENE` records, shape (num_envs,).
        objects: `OBJECT` records, shape (num_envs, 512): vehicles, obstacles and marks of each environment in
            the order of `road.vehicles`, then `road.objects`, without the ego and the roadside. Vehicles of
            any size are of `MODEL_CAR`; an obstacle with a grey of its own is of `MODEL_BOX`; pedestrians and
            two-wheelers have models of their own; `range` is `MAX_RANGE`.
        object_counts: Number of objects, int64, shape (num_envs,).
        enabled: Cameras in use, bool, shape (num_envs, cameras), initially all. A camera that is not enabled
            is neither drawn nor stepped and keeps its last outputs. Its neuron is reset before the first
            frame after a pause.
        frames: The last frames, one array per frame shape, detector and number of columns, uint8, shape
            (num_envs, cameras of that kind, height, width); see `frame_of` and `stacked_frames`.
        responses: The last outputs of the neurons, arrays of shape (num_envs, cameras), updated in place.
        signals: The `SIGNALS` among them, float64, shape (num_envs, 3, cameras).
    """

    responses: Response

    def __init__(
        self,
        camera: CameraSpec,
        fps: float,
        params: LGMDParams,
        num_envs: int = 1,
        threads: int | None = None,
    ) -> None:
        self.num_envs = num_envs
        cameras = make_cameras(camera)
        self.names = list(cameras)
        self.shapes = [item.shape for item in cameras.values()]
        self.detectors = [
            item.detector if isinstance(item, CameraParams) else "lgmd" for item in cameras.values()
        ]
        self.columns = [item.columns if isinstance(item, CameraParams) else 0 for item in cameras.values()]
        self._top_views = [
            {k: item for k, item in enumerate(made.values()) if isinstance(item, BirdsEye)}
            for made in (cameras, *(make_cameras(camera) for _ in range(num_envs - 1)))
        ]
        self._variants = Variants(list(cameras.values()))
        unchanged, _ = self._variants.make({})
        self._used_variants = [unchanged] * num_envs
        self._textures: list[float | None] = [None] * num_envs
        self._fields: list[dict[str, Any]] = [{}] * num_envs
        known = unchanged.known_deceleration
        self.known_decelerations = None if known is None else np.full((num_envs, 1), known)
        size = num_envs, len(self.names)
        self._scene_table = SceneTable(num_envs)
        self._roads = RoadPool(num_envs, len(unchanged.road_keys))
        self.enabled = np.ones(size, np.bool_)
        self._stale = np.zeros(size, np.bool_)
        self._all = np.ones(num_envs, np.bool_)
        numbers = np.zeros((num_envs, len(NUMBERS), len(self.names)))
        self._outputs = numbers, np.zeros(size, np.int64), np.zeros(size, np.bool_)
        self._threads = Threads(threads or 1)
        by_kind: dict[tuple[tuple[int, int], str, int], list[int]] = {}
        for index, kind in enumerate(zip(self.shapes, self.detectors, self.columns, strict=True)):
            by_kind.setdefault(kind, []).append(index)
        self._groups = [
            SensorGroup(
                neuron.make(
                    detector,
                    shape,
                    fps,
                    num_envs * len(members),
                    params,
                    columns=columns,
                    derotated=any(
                        p is not None and p.derotated for p in (unchanged.params[k] for k in members)
                    ),
                ),
                members,
                unchanged.params,
                self.enabled,
                self._stale,
                self._outputs,
                columns,
            )
            for (shape, detector, columns), members in by_kind.items()
        ]
        self._shares = self._share_frames(unchanged)
        # Index of each camera's group, and of the camera in that group.
        self._locations = [
            next((g, group.members.index(k)) for g, group in enumerate(self._groups) if k in group.members)
            for k in range(len(self.names))
        ]
        self._link()
        self.reset()

    @property
    def cameras(self) -> list[dict[str, EgoCamera | BirdsEye]]:
        """Per environment, the cameras by name, posed as in their last frames."""
        return [
            {name: self._camera(k, index) for k, name in enumerate(self.names)}
            for index in range(self.num_envs)
        ]

    def read(self, env: gym.Env, index: int = 0) -> None:
        """Read the present state of a highway-env environment, and render its top views.

        An environment with a method `write_scene`, such as `BrakingEnv`, writes its state itself: it receives
        `scenes`, `objects` and `object_counts` of one environment.

        Args:
            env: The environment, wrapped or not, after its first reset.
            index: Index of the environment.

        Raises:
            ValueError: If the environment has no road or ego yet, or a pose is not finite.
        """
        variant = self._used_variants[index]
        base: Any = env.unwrapped
        write_scene = getattr(base, "write_scene", None)
        if write_scene is None or base.road is None:
            self._scene_table.read(base, variant.view, index)
        else:
            write_scene(self._scene_table.at(index))
        self._roads.assign(index, base.road, variant.road_keys)
        for camera, top_view in self._top_views[index].items():
            if self.enabled[index, camera]:
                top_view.render(env, self.frame_of(camera, index))

    def set_road(self, index: int, road: Any) -> None:
        """Set the road of environment `index`, a highway-env `Road` or `RoadNetwork`.

        A call with the same network as before returns at once: a network must not change. One thread at a
        time may call this method and `set_camera_fields`, also while others process other environments.
        """
        self._roads.assign(index, road, self._used_variants[index].road_keys)

    def set_camera_fields(self, index: int, fields: Mapping[str, Any] | None) -> None:
        """Change the cameras of environment `index` relative to the `camera` argument.

        Fields that change the road, such as `world`, apply with the next `set_road` or `read`: they may not
        fit the road of the last episode.

        Args:
            index: Index of the environment.
            fields: Fields of `CameraParams`, and optionally `condition`; None or empty for no change.

        Raises:
            ValueError: If a field is unknown or out of range, changes the shape, detector or columns of a
                camera, `brake_known` or `derotated`.
        """
        fields = fields or {}
        if fields == self._fields[index]:
            return
        variant, texture = self._variants.make(fields)
        for (group, member), p in zip(self._locations, variant.params, strict=True):
            if p is not None:
                self._groups[group].batch.set_params(index, member, p, texture)
        if self.known_decelerations is not None:
            self.known_decelerations[index] = variant.known_deceleration
        self._used_variants[index], self._textures[index] = variant, texture
        self._fields[index] = dict(fields)

    def process(self, first: int, last: int, active: np.ndarray | None = None) -> None:
        """Draw and process one frame of every enabled camera of the environments first..last-1.

        Threads may process disjoint ranges at once.

        Args:
            first: First environment.
            last: Last environment + 1.
            active: Selection of the environments with a new frame, bool, shape (num_envs,); None for all. The
                others keep their frames and outputs.
        """
        active = self._all if active is None else active
        if self._shares and not self.enabled.all():
            self._separate()
        scene_table, roads = self._scene_table.bundle, self._roads.bundle
        for group in self._groups:
            group.process(first, last, active, scene_table, roads)

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
        for group in self._groups:
            group.reset(mask)

    def frame_of(self, camera: int, index: int = 0) -> np.ndarray:
        """Return a view of the last frame of one camera of environment `index`, uint8, (height, width)."""
        group, row = self._locations[camera]
        return self._groups[group].frames[index, row]

    def stacked_frames(self) -> np.ndarray:
        """Return the last frames of cameras with one shape, uint8, shape (num_envs, cameras, height, width).

        A view if all cameras have the same detector and number of columns, else a new array.
        """
        if len(self._groups) == 1:
            return self.frames[0]
        frames = [self.frames[group][:, row] for group, row in self._locations]
        return np.stack(frames, axis=1)

    def column_potentials(self) -> np.ndarray:
        """Return the last potentials of the columns of all cameras, new array, (num_envs, sum of columns)."""
        parts = [self._groups[group].columns[:, row] for group, row in self._locations]
        return np.concatenate(parts, axis=1)

    def response_of(self, index: int = 0) -> Response:
        """Return a copy of the last outputs of environment `index`, arrays of shape (cameras,)."""
        return Response(*(field[index].copy() for field in self.responses))

    def layers(self, camera: int = 0) -> dict[str, np.ndarray]:
        """Return the layer maps of one camera's last frame in the first environment."""
        group, row = self._locations[camera]
        return {name: maps[row] for name, maps in self._groups[group].neuron.layers.items()}

    def shown_layers(self, camera: int = 0) -> Mapping[str, Layer]:
        """Return those of `layers` that pictures show."""
        return self._groups[self._locations[camera][0]].neuron.shown_layers

    def bounds(self, signal: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper bounds of an output of each camera, float32, shape (cameras,)."""
        declared = [self._groups[group].neuron.signals[signal] for group, _ in self._locations]
        low, high = zip(*((item.low, item.high) for item in declared), strict=True)
        return np.array(low, np.float32), np.array(high, np.float32)

    def close(self) -> None:
        """Close the cameras that hold resources."""
        for top_views in self._top_views:
            for top_view in top_views.values():
                top_view.close()

    def _share_frames(self, unchanged: Variant) -> bool:
        """Let groups with equal views, such as two detectors on one lens, draw their frames once."""
        drawn: dict[Any, SensorGroup] = {}
        for group in self._groups:
            params = [unchanged.params[member] for member in group.members]
            views = tuple(
                None if p is None else replace(p, name="view", detector="lgmd", columns=0) for p in params
            )
            if None not in views and views in drawn:
                group.share(drawn[views])
            else:
                drawn[views] = group
        return len(drawn) < len(self._groups)

    def _separate(self) -> None:
        """Draw the frames of all groups on their own: cameras that pause keep their exposure."""
        with _separation:
            for group in self._groups:
                group.separate()
            self._shares = False
            self.frames = [group.frames for group in self._groups]

    def _camera(self, camera: int, index: int) -> EgoCamera | BirdsEye:
        p, texture = self._used_variants[index].params[camera], self._textures[index]
        if p is None:
            return self._top_views[index][camera]
        group, row = self._locations[camera]
        p = p if texture is None else CameraParams.make(p, texture=texture)
        return EgoCamera.posed(p, self._groups[group].batch.lenses[index, row, 0])

    def _link(self) -> None:
        """Name the arrays that belong to others."""
        scene_table = self._scene_table
        self.scenes, self.objects, self.object_counts = (
            scene_table.scenes,
            scene_table.objects,
            scene_table.object_counts,
        )
        self.frames = [group.frames for group in self._groups]
        numbers, spikes, alerts = self._outputs
        self.signals = numbers[:, : len(SIGNALS)]
        fields = {name: numbers[:, field] for field, name in enumerate(NUMBERS)}
        self.responses = Response(**fields, spikes=spikes, alert=alerts)

    def __getstate__(self) -> dict[str, Any]:
        linked = ("scenes", "objects", "object_counts", "frames", "responses", "signals")
        return {name: value for name, value in self.__dict__.items() if name not in linked}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._link()

"""SensorArray: the cameras and neurons of one or more environments."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import gymnasium as gym
import numpy as np

from lgmd_gym.camera import BIRDSEYE, BirdsEye, CameraItem, CameraParams, CameraRig, CameraSpec, EgoCamera
from lgmd_gym.neuron import LGMD, LGMDParams, Response

Camera: TypeAlias = EgoCamera | BirdsEye


def make_cameras(camera: CameraSpec) -> dict[str, Camera]:
    """Return cameras by name.

    Args:
        camera: A preset name, "birdseye", `CameraParams`, a mapping of its fields, or a sequence of these.

    Raises:
        ValueError: For an unknown preset, an empty sequence, or a repeated name.
    """
    several = isinstance(camera, Sequence) and not isinstance(camera, str)
    items: Sequence[CameraItem] = camera if several else [camera]  # type: ignore[assignment, list-item]
    if not items:
        raise ValueError(f"camera must have at least one element, got {camera!r}; use camera='fovea'")
    cameras: dict[str, Camera] = {}
    for item in items:
        name, built = _make_camera(item)
        if name in cameras:
            raise ValueError(f"camera names must be unique, got {name!r} twice; rename one of them")
        cameras[name] = built
    return cameras


def _make_camera(item: CameraItem) -> tuple[str, Camera]:
    if item == BIRDSEYE:
        return BIRDSEYE, BirdsEye()
    if isinstance(item, Mapping) and item.get("name") == BIRDSEYE:
        return BIRDSEYE, BirdsEye(**{key: value for key, value in item.items() if key != "name"})
    params = CameraParams.make(item)
    return params.name, EgoCamera(params)


def _with_fields(camera: Camera, fields: dict[str, Any]) -> Camera:
    """Return an `EgoCamera` with changed fields; other cameras are returned unchanged."""
    if not isinstance(camera, EgoCamera) or not fields:
        return camera
    return EgoCamera(camera.params, **fields)


class _ShapeGroup(NamedTuple):
    """Cameras with the same frame shape, whose neurons are stepped in one call.

    Attributes:
        neuron: num_envs * len(members) neurons, ordered by environment, then by camera.
        members: Indices of the cameras.
    """

    neuron: LGMD
    members: list[int]


class SensorArray:
    """Cameras of one or more environments, each with its own neuron.

    Args:
        camera: Cameras of every environment, see `make_cameras`.
        fps: Camera frame rate [Hz].
        params: Parameters of the neurons.
        num_envs: Number of environments.
        threads: Number of threads of a step; None for the calling thread only.

    Attributes:
        cameras: Per environment, the cameras by name.
        names: Names of the cameras.
        shapes: Frame shapes (height, width) of the cameras [px].
    """

    def __init__(
        self,
        camera: CameraSpec,
        fps: float,
        params: LGMDParams,
        num_envs: int = 1,
        threads: int | None = None,
    ) -> None:
        self.num_envs = num_envs
        self.cameras = [make_cameras(camera) for _ in range(num_envs)]
        self._base_cameras = [dict(cameras) for cameras in self.cameras]
        self._applied_fields: list[dict[str, Any]] = [{}] * num_envs
        self._rigs = [CameraRig(list(cameras.values())) for cameras in self.cameras]
        self.names = list(self.cameras[0])
        self.shapes = [camera.shape for camera in self.cameras[0].values()]
        by_shape: dict[tuple[int, int], list[int]] = {}
        for index, shape in enumerate(self.shapes):
            by_shape.setdefault(shape, []).append(index)
        self._groups = [
            _ShapeGroup(LGMD(shape, fps, params, num_envs * len(members), threads=threads), members)
            for shape, members in by_shape.items()
        ]
        # Index of each camera's group, and of the camera in that group.
        self._locations = [
            next((g, members.index(k)) for g, (_, members) in enumerate(self._groups) if k in members)
            for k in range(len(self.names))
        ]

    def empty_frames(self) -> list[np.ndarray]:
        """Return buffers for one frame of every camera.

        Returns:
            One array per frame shape, uint8, shape (num_envs, cameras of that shape, height, width).
        """
        return [
            np.zeros((self.num_envs, len(members), *neuron.shape), np.uint8)
            for neuron, members in self._groups
        ]

    def apply_camera_fields(self, env: gym.Env, index: int = 0) -> None:
        """Apply `env.unwrapped.camera_fields`, if present, to the cameras of environment `index`.

        The attribute maps fields of `CameraParams`, and optionally `condition`, to values. Call this method
        after each reset.
        """
        fields: dict[str, Any] = getattr(env.unwrapped, "camera_fields", None) or {}
        if fields != self._applied_fields[index]:
            self._applied_fields[index] = dict(fields)
            base = self._base_cameras[index]
            self.cameras[index] = {name: _with_fields(camera, fields) for name, camera in base.items()}
            self._rigs[index] = CameraRig(list(self.cameras[index].values()))

    def render(self, env: gym.Env, frames: list[np.ndarray], index: int = 0) -> None:
        """Render all cameras of environment `index` into `frames`, see `empty_frames`."""
        self._rigs[index].render(env, [frames[group][index, row] for group, row in self._locations])

    def step(self, frames: list[np.ndarray], active: np.ndarray | None = None) -> Response:
        """Step the neurons.

        Args:
            frames: Frames in the layout of `empty_frames`.
            active: Selection of the environments with a new frame, bool, shape (num_envs,); None for all.
                The neurons of other environments keep their outputs.

        Returns:
            Arrays of shape (num_envs, cameras).
        """
        responses: list[Response] = []
        for (neuron, members), batch in zip(self._groups, frames, strict=True):
            selected = None if active is None else np.repeat(active, len(members))
            responses.append(neuron.step(batch.reshape(-1, *neuron.shape), selected))
        return self._in_camera_order(responses)

    def reset(self, mask: np.ndarray | None = None) -> None:
        """Reset the neurons of selected environments, bool, shape (num_envs,); None for all."""
        for neuron, members in self._groups:
            neuron.reset(None if mask is None else np.repeat(mask, len(members)))

    def frame_of(self, frames: list[np.ndarray], camera: int, index: int = 0) -> np.ndarray:
        """Return a view of the frame of one camera of environment `index`, uint8, shape (height, width)."""
        group, row = self._locations[camera]
        return frames[group][index, row]

    def layers(self, camera: int = 0) -> dict[str, np.ndarray]:
        """Return the layer maps of one camera's last frame in the first environment."""
        group, row = self._locations[camera]
        return {name: maps[row] for name, maps in self._groups[group].neuron.layers.items()}

    def close(self) -> None:
        """Close the cameras that hold resources."""
        for cameras in self.cameras:
            for camera in cameras.values():
                if isinstance(camera, BirdsEye):
                    camera.close()

    def _in_camera_order(self, responses: list[Response]) -> Response:
        """Concatenate the responses of the groups in the order of the cameras."""
        if len(responses) == 1:
            return Response(*(field.reshape(self.num_envs, -1) for field in responses[0]))
        order = np.argsort([member for _, members in self._groups for member in members])
        return Response(
            *(
                np.concatenate([np.reshape(part, (self.num_envs, -1)) for part in field], axis=1)[:, order]
                for field in zip(*responses, strict=True)
            )
        )

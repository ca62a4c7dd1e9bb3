"""Cameras and their neurons, for one environment or a batch of them."""

from typing import Any, NamedTuple, Protocol

import gymnasium as gym
import numpy as np

from lgmd_gym.camera import BirdsEye, CameraParams, CameraRig, EgoCamera
from lgmd_gym.neuron import LGMD, LGMDParams, Response

BIRDSEYE = "birdseye"


class Camera(Protocol):
    """Anything that turns a highway-env environment into grey frames."""

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of a frame [px]."""
        ...

    def render(self, env: gym.Env, out: np.ndarray | None = None) -> np.ndarray:
        """Return the present frame, uint8, shape (height, width)."""
        ...


def make_cameras(camera: Any) -> dict[str, Camera]:
    """Return the cameras that a `camera` argument names, by name.

    Args:
        camera: A preset name, "birdseye", a `CameraParams`, the dict of one, or a list of these.

    Raises:
        ValueError: For an unknown preset, two cameras of one name, or none at all.
    """
    wanted = list(camera) if isinstance(camera, list | tuple) else [camera]
    if not wanted:
        raise ValueError("camera needs at least one preset name, CameraParams or dict, got an empty list")
    cameras: dict[str, Camera] = {}
    for item in wanted:
        name, built = _make_camera(item)
        if name in cameras:
            raise ValueError(f"two cameras are named {name!r}; give one of them another name")
        cameras[name] = built
    return cameras


def _make_camera(item: Any) -> tuple[str, Camera]:
    if item == BIRDSEYE:
        return BIRDSEYE, BirdsEye()
    if isinstance(item, dict) and item.get("name") == BIRDSEYE:
        return BIRDSEYE, BirdsEye(**{key: value for key, value in item.items() if key != "name"})
    params = CameraParams.make(item)
    return params.name, EgoCamera(params)


def _under(camera: Camera, fields: dict[str, Any]) -> Camera:
    """Return a camera with fields laid over it; one without such fields stays as it is."""
    if not isinstance(camera, EgoCamera) or not fields:
        return camera
    given = dict(fields)
    params = camera.params.with_condition(given.pop("condition", "clear"))
    return EgoCamera(CameraParams.make(params, **given))


class _Group(NamedTuple):
    """Cameras of one frame shape, stepped in one call.

    Attributes:
        neuron: Holds count × members neurons, environment by environment.
        members: Indices of the cameras.
    """

    neuron: LGMD
    members: list[int]


class SensorArray:
    """The cameras of one or more environments, each before its own neuron.

    Args:
        camera: See `make_cameras`; every environment has its own set.
        fps: Camera frames per second [Hz].
        params: The neurons' parameters.
        count: Number of environments.
        threads: Threads of a step; None for none beside the caller's.
    """

    def __init__(
        self, camera: Any, fps: float, params: LGMDParams, count: int = 1, threads: int | None = None
    ) -> None:
        self.sets = [make_cameras(camera) for _ in range(count)]
        self._bare = [dict(one) for one in self.sets]
        self._worn: list[dict[str, Any]] = [{}] * count
        self._rigs = [CameraRig(list(one.values())) for one in self.sets]
        self.names = list(self.sets[0])
        self.shapes = [one.shape for one in self.sets[0].values()]
        self.count = count
        by_shape: dict[tuple[int, int], list[int]] = {}
        for index, shape in enumerate(self.shapes):
            by_shape.setdefault(shape, []).append(index)
        self.groups = [
            _Group(LGMD(shape, fps=fps, params=params, num=count * len(members), threads=threads), members)
            for shape, members in by_shape.items()
        ]

        # Camera -> where its frame lies: group and row.
        self._places = {
            member: (group, row)
            for group, (_, members) in enumerate(self.groups)
            for row, member in enumerate(members)
        }

    def empty_frames(self) -> list[np.ndarray]:
        """Return room for one frame of every camera: per group uint8 (count, members, height, width)."""
        return [
            np.zeros((self.count, len(members), *neuron.shape), np.uint8) for neuron, members in self.groups
        ]

    def fit(self, env: gym.Env, index: int = 0) -> None:
        """Lay `env.unwrapped.camera_fields`, if there are any, over the cameras of environment `index`.

        An environment whose episodes differ in light or weather says so there: fields of `CameraParams`,
        and `condition` for a named one. To be called after each reset.
        """
        fields = getattr(env.unwrapped, "camera_fields", None) or {}
        if fields != self._worn[index]:
            self._worn[index] = dict(fields)
            self.sets[index] = {name: _under(one, fields) for name, one in self._bare[index].items()}
            self._rigs[index] = CameraRig(list(self.sets[index].values()))

    def render(self, env: gym.Env, frames: list[np.ndarray], index: int = 0) -> None:
        """Render every camera of environment number `index` into its place in `frames`."""
        places = self._places
        outs = [frames[group][index, row] for group, row in (places[k] for k in range(len(places)))]
        self._rigs[index].render(env, outs)

    def step(self, frames: list[np.ndarray], active: np.ndarray | None = None) -> Response:
        """Show the neurons their frames.

        Args:
            frames: As from `empty_frames`.
            active: Which environments have a new frame, bool (count,); the others answer as before.
                None: all have.

        Returns:
            Arrays of shape (count, cameras).
        """
        answers = []
        for (neuron, members), batch in zip(self.groups, frames, strict=True):
            chosen = None if active is None else np.repeat(active, len(members))
            answers.append(neuron.step(batch.reshape(-1, *neuron.shape), chosen))
        return self._in_order(answers)

    def reset(self, chosen: np.ndarray | None = None) -> None:
        """Have the neurons of the chosen environments, bool (count,), forget everything; None: of all."""
        for neuron, members in self.groups:
            neuron.reset(None if chosen is None else np.repeat(chosen, len(members)))

    def of_camera(self, frames: list[np.ndarray], camera: int, index: int = 0) -> np.ndarray:
        """Return one camera's frame out of `frames`, a view, uint8 (height, width)."""
        group, row = self._place(camera)
        return frames[group][index, row]

    def layers(self, camera: int = 0) -> dict[str, np.ndarray]:
        """Return the layer maps of one camera's last frame, of the first environment."""
        group, row = self._place(camera)
        return {name: maps[row] for name, maps in self.groups[group].neuron.layers.items()}

    def close(self) -> None:
        """Let go of what the cameras hold."""
        for cameras in self.sets:
            for camera in cameras.values():
                close = getattr(camera, "close", None)
                if close is not None:
                    close()

    def _place(self, camera: int) -> tuple[int, int]:
        if camera not in self._places:
            raise IndexError(f"no camera {camera} among {len(self.names)}")
        return self._places[camera]

    def _in_order(self, answers: list[Response]) -> Response:
        """Put the groups' answers into one, shape (count, cameras), in the cameras' order."""
        if len(answers) == 1:
            return Response(*(field.reshape(self.count, -1) for field in answers[0]))
        order = np.argsort([member for _, members in self.groups for member in members])
        return Response(
            *(
                np.concatenate([np.reshape(part, (self.count, -1)) for part in field], axis=1)[:, order]
                for field in zip(*answers, strict=True)
            )
        )

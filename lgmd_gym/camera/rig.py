"""CameraRig: several cameras on one car, drawn together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lgmd_gym.camera.ego import EgoCamera, check_frame
from lgmd_gym.camera.render.context import RenderContext, object_buffer, read_objects, scene_of, shared_key


class CameraRig:
    """Cameras on one car: the scene is read once, and lenses of one frame size are drawn in one call.

    Frames are those of the cameras' own `render`, to the bit, and each camera's `project` speaks of its
    last frame here.

    Args:
        cameras: `EgoCamera`s; anything else with `render(env, out=...)` and `shape`, such as a
            `BirdsEye`, is rendered by itself.

    Example:
        >>> rig = CameraRig([EgoCamera("fovea"), EgoCamera("wide")])
        >>> [camera.params.name for camera in rig.cameras]
        ['fovea', 'wide']
    """

    def __init__(self, cameras: Sequence[Any]) -> None:
        self.cameras = tuple(cameras)
        self._alone = [k for k, camera in enumerate(self.cameras) if not isinstance(camera, EgoCamera)]
        groups: dict[tuple[Any, ...], list[int]] = {}
        for k, camera in enumerate(self.cameras):
            if isinstance(camera, EgoCamera):
                groups.setdefault(shared_key(camera.params), []).append(k)
        stages = [
            RenderContext([self.cameras[k].params for k in members])
            if len(members) > 1
            else self.cameras[members[0]].stage
            for members in groups.values()
        ]
        self._groups = list(zip(stages, groups.values(), strict=True))
        self._frames = [
            np.zeros((len(members), *stage.image.shape), dtype=np.uint8) for stage, members in self._groups
        ]
        self._objects = object_buffer()

    def render(self, env: Any, outs: Sequence[np.ndarray] | None = None) -> list[np.ndarray]:
        """Return what every camera sees now.

        Args:
            env: A highway-env environment, wrapped or not, after its first reset.
            outs: One frame per camera to draw into, uint8, shape (height, width); new ones if None.

        Raises:
            ValueError: If there is no road or ego yet, a pose is not finite, or a frame does not fit.
        """
        if outs is None:
            outs = [np.empty(camera.shape, dtype=np.uint8) for camera in self.cameras]
        for camera, out in zip(self.cameras, outs, strict=True):
            check_frame(out, camera.shape)
        for k in self._alone:
            self.cameras[k].render(env, out=outs[k])
        if self._groups:
            self._render_groups(env, outs)
        return list(outs)

    def _render_groups(self, env: Any, outs: Sequence[np.ndarray]) -> None:
        scene = scene_of(env)
        poses = [stage.aim(scene) for stage, _ in self._groups]
        everywhere = [pose for group in poses for pose in group]
        read: tuple[int, str] | None = None
        count = 0
        for (stage, members), frames in zip(self._groups, self._frames, strict=True):
            p = stage.params[0]
            # Vehicles' greys hang on the seed: cameras that differ in it need lists of their own.
            if read != (p.seed, p.vehicles):
                read = (p.seed, p.vehicles)
                count = read_objects(self._objects, scene, p, everywhere)
            single = len(members) == 1
            stage.draw(outs[members[0]][None] if single else frames, scene, self._objects, count)
            for row, k in enumerate(members):
                self.cameras[k].seen_from(stage.cams[row, 0])
                if not single:
                    outs[k][...] = frames[row]

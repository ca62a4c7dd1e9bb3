"""CameraRig: several cameras on one car, rendered together."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from lgmd_gym.camera.ego import EgoCamera, check_frame
from lgmd_gym.camera.objects import ObjectList
from lgmd_gym.camera.render.context import RenderContext, context_key
from lgmd_gym.camera.scene import scene_of


class CameraRig:
    """Cameras on one car: the scene is read once, and cameras of one frame size are drawn in one call.

    Frames equal those of the cameras' own `render` to the bit, and each camera's `project` refers to its last
    frame of the rig.

    Args:
        cameras: `EgoCamera`s, or other objects with `render(env, out=...)` and `shape` (such as a
            `BirdsEye`), which are rendered separately.

    Example:
        >>> rig = CameraRig([EgoCamera("fovea"), EgoCamera("wide")])
        >>> [camera.params.name for camera in rig.cameras]
        ['fovea', 'wide']
    """

    def __init__(self, cameras: Sequence[Any]) -> None:
        self.cameras = tuple(cameras)
        self._separate = [k for k, camera in enumerate(self.cameras) if not isinstance(camera, EgoCamera)]
        groups: dict[tuple[Any, ...], list[int]] = {}
        for k, camera in enumerate(self.cameras):
            if isinstance(camera, EgoCamera):
                groups.setdefault(context_key(camera.params), []).append(k)
        contexts = [
            RenderContext([self.cameras[k].params for k in members])
            if len(members) > 1
            else self.cameras[members[0]].context
            for members in groups.values()
        ]
        self._groups = list(zip(contexts, groups.values(), strict=True))
        self._frames = [
            np.zeros((len(members), *context.params[0].shape), dtype=np.uint8)
            for context, members in self._groups
        ]
        self._objects = ObjectList()

    def render(self, env: Any, outs: Sequence[np.ndarray] | None = None) -> list[np.ndarray]:
        """Render the present frame of every camera.

        Args:
            env: A highway-env environment, wrapped or not, after its first reset.
            outs: One frame per camera to draw into, uint8, shape (height, width); new ones if None.

        Raises:
            ValueError: If the environment has no road or ego yet, a pose is not finite, or a frame has
                another shape or dtype.
        """
        if outs is None:
            outs = [np.empty(camera.shape, dtype=np.uint8) for camera in self.cameras]
        for camera, out in zip(self.cameras, outs, strict=True):
            check_frame(out, camera.shape)
        for k in self._separate:
            self.cameras[k].render(env, out=outs[k])
        if self._groups:
            self._render_groups(env, outs)
        return list(outs)

    def _render_groups(self, env: Any, outs: Sequence[np.ndarray]) -> None:
        scene = scene_of(env)
        poses = [context.aim(scene) for context, _ in self._groups]
        all_poses = [pose for group in poses for pose in group]
        last_read: tuple[int, str] | None = None
        for (context, members), frames in zip(self._groups, self._frames, strict=True):
            p = context.params[0]
            # The greys of vehicles depend on the seed, and their models on `vehicles`.
            if last_read != (p.seed, p.vehicles):
                last_read = (p.seed, p.vehicles)
                self._objects.read(scene, p, all_poses)
            single = len(members) == 1
            context.draw(outs[members[0]][None] if single else frames, scene, self._objects)
            for row, k in enumerate(members):
                self.cameras[k].set_lens(context.lenses[row, 0])
                if not single:
                    outs[k][...] = frames[row]

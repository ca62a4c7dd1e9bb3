"""FarFieldRegistration: pitch, roll and yaw of a camera from its own frames."""

from dataclasses import dataclass
from math import exp
from typing import Any

import numpy as np

from lgmd_gym.camera.params import MAX_WIDTH
from lgmd_gym.errors import check_positive, check_size
from lgmd_gym.kernels.simd import LANES
from lgmd_gym.sensing.registration_kernels import register
from lgmd_gym.sensing.registration_layout import (
    BANDS,
    CONSTANTS,
    MARGIN_ROWS,
    PAD,
    STARTED,
    STATE_SIZE,
    make_space,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class RegistrationParams:
    """Parameters of `FarFieldRegistration`.

    Attributes:
        reference_s: Time constant of the reference image [s].
        variance_s: Time constant of the variance of the residual of each pixel [s].
        mean_s: Time constant of the mean rotation, which is subtracted [s].
        first_variance: Variance of the residual before the first frames [grey levels²].
        least_variance: Added to the variance of each pixel [grey levels²].
        edge: Displacement of an edge that counts as noise [px].
        outlier: Square of the residual at which the weight is a quarter, as a multiple of its variance.
        share: Share of the pixels that are independent of each other; weight of the image against the prior.
        pitch_px: Standard deviation of the shift due to pitch before the measurement [px].
        roll_rad: Standard deviation of the roll before the measurement [rad].
        yaw_px: Standard deviation of the horizontal shift that the turn of the car does not explain [px].
        gain: Standard deviation of the change of the gain between two frames.
        offset: Standard deviation of the change of the offset between two frames [grey levels].
    """

    reference_s: float = 5.0
    variance_s: float = 0.33
    mean_s: float = 10.0
    first_variance: float = 36.0
    least_variance: float = 3.0
    edge: float = 0.15
    outlier: float = 4.0
    share: float = 0.1
    pitch_px: float = 1.5
    roll_rad: float = 0.0015
    yaw_px: float = 0.1
    gain: float = 0.3
    offset: float = 30.0

    def record(self, fps: float, focal_px: float) -> np.ndarray:
        """Return the `CONSTANTS` of the kernels, shape (1,).

        Args:
            fps: Frame rate [Hz].
            focal_px: Focal length of the camera [px].
        """
        rates = [1.0 - exp(-1.0 / (s * fps)) for s in (self.reference_s, self.variance_s, self.mean_s)]
        spreads = (self.pitch_px, self.roll_rad, self.yaw_px, self.gain, self.offset)
        values = (
            *rates, self.first_variance, self.least_variance, self.edge, self.outlier, self.share, focal_px,
            *(1.0 / spread**2 for spread in spreads),
        )  # fmt: skip
        return np.array([values], CONSTANTS)


class FarFieldRegistration:
    """Pitch, roll and yaw of N cameras that are fixed to cars, estimated from their frames.

    Each frame, smoothed by a binomial of 3 × 3 px, is registered with a reference image. A least-squares fit
    (Lucas and Kanade, 1981; three iterations) yields five numbers: vertical shift (pitch), roll, horizontal
    shift (yaw, without the known turn of the car), and gain and offset of the exposure.

    The weight of a pixel is high where the image of the road ahead stays the same: the horizon, distant
    surroundings, and fog or a dark sky above a road. It falls with the variance of the residual of the pixel
    in the frames before, which is high in the near ground and on other vehicles, and with its residual in
    the present frame. A weak prior leaves out what the image does not determine, such as the roll in fog.

    The reference follows the registered frames slowly, and the mean rotation is subtracted: the rotation is
    relative to the mean direction of the last `mean_s` seconds.

    Args:
        shape: (height, width) of the frames [px]; the height is 4 more than a multiple of 4, the width a
            multiple of 16, at least 32.
        fps: Frame rate [Hz].
        focal_px: Focal length of the camera [px].
        num: Number of cameras N.
        params: Parameters; None for the defaults.

    Attributes:
        rotations: The last estimates, float64, shape (N, 3): pitch upwards, and roll and yaw to the right
            [degrees].
        started: Whether each camera has a reference, bool, shape (N,).

    Raises:
        ValueError: For a shape that does not fit the blocks.
    """

    def __init__(
        self,
        shape: tuple[int, int],
        fps: float,
        focal_px: float,
        num: int = 1,
        params: RegistrationParams | None = None,
    ) -> None:
        self.shape = height, width = check_size("shape", shape, 8, MAX_WIDTH)
        if (height - 2 * MARGIN_ROWS) % BANDS or width % LANES or width < 2 * LANES or height <= 2 * PAD:
            raise ValueError(
                f"shape must be (height, width) with a height of 4 more than a multiple of 4, above 16, and "
                f"a width that is a multiple of 16, at least 32, got {shape}; use (48, 160)"
            )
        fps, focal_px = check_positive("fps", fps), check_positive("focal_px", focal_px)
        self._const = (params or RegistrationParams()).record(fps, focal_px)
        self._state = (
            np.zeros((num, STATE_SIZE)),
            np.zeros((num, *shape), np.float32),
            np.zeros((num, *shape), np.float32),
        )
        self.rotations = np.zeros((num, 3))
        self._no_turns, self._all = np.zeros(num), np.ones(num, np.bool_)
        self._spaces: list[tuple[np.ndarray, ...]] = []

    @property
    def started(self) -> np.ndarray:
        """Whether each camera has a reference, bool, shape (N,)."""
        return self._state[0][:, STARTED] != 0.0

    def step(self, frames: np.ndarray, turns: np.ndarray | None = None) -> np.ndarray:
        """Register one frame per camera; the first frame of a camera is its reference, with a rotation of 0.

        Args:
            frames: Frames, contiguous uint8, shape (N, height, width).
            turns: Turn of each car to the right since its last frame, float64, shape (N,) [rad]; None for 0.

        Returns:
            `rotations`.

        Raises:
            ValueError: For frames of another shape or dtype, or turns of another shape.
        """
        expected = (len(self.rotations), *self.shape)
        if frames.shape != expected or frames.dtype != np.uint8:
            raise ValueError(f"frames must be uint8 of shape {expected}, got {frames.dtype} {frames.shape}")
        turned = self._no_turns if turns is None else np.asarray(turns, np.float64)
        if turned.shape != self._no_turns.shape:  # the kernel checks no bounds
            raise ValueError(f"turns must have the shape {self._no_turns.shape}, got {turned.shape}")
        self.step_range(0, len(self.rotations), np.ascontiguousarray(frames), turned, self._all)
        return self.rotations

    def step_range(
        self, first: int, last: int, frames: np.ndarray, turns: np.ndarray, active: np.ndarray
    ) -> None:
        """Register frames of the active cameras among first..last-1, without a check of the arguments.

        Threads may process disjoint ranges at once.

        Args:
            first: First camera.
            last: Last camera + 1.
            frames: Frames, contiguous uint8, shape (N, height, width).
            turns: Turn of each car to the right since its last frame, float64, shape (N,) [rad].
            active: Selection of the cameras, bool, shape (N,).
        """
        try:  # threads take and return scratch memory; both list operations are atomic
            space = self._spaces.pop()
        except IndexError:
            space = make_space(self.shape)
        register(first, last, active, frames, turns, self._const, self._state, self.rotations, space)
        self._spaces.append(space)

    def reset(self, mask: np.ndarray | None = None) -> None:
        """Forget the references of selected cameras, bool, shape (N,); None for all."""
        selected = self._all if mask is None else mask
        self._state[0][selected] = 0.0
        self.rotations[selected] = 0.0

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_spaces": []}

"""Parameters of the LPLC2 model."""

from dataclasses import dataclass

from lgmd_gym.errors import check_flag, check_whole
from lgmd_gym.neuron.motion_params import MotionParams


@dataclass(frozen=True, slots=True, kw_only=True)
class LPLC2Params(MotionParams):
    """Parameters of the LPLC2 model, in addition to those of `MotionParams`; see `LPLC2` for the equations.

    Attributes:
        radius_px: Length of the four arms of a unit, >= 1 [px]; at most half of the smaller side of a frame.
        stride_px: Distance of neighbouring units, >= 1 [px].
        vertical: Whether a unit requires motion along all four arms; if False, it only has the left and the
            right one.

    Raises:
        ValueError: For a value out of range or of another type.
    """

    radius_px: int = 8
    stride_px: int = 4
    vertical: bool = True

    def __post_init__(self) -> None:
        MotionParams.__post_init__(self)
        for name in ("radius_px", "stride_px"):
            object.__setattr__(self, name, check_whole(name, getattr(self, name), 1))
        object.__setattr__(self, "vertical", check_flag("vertical", self.vertical))

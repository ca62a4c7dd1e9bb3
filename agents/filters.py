"""Filters over camera frames that several rules share."""


class ConsecutiveFrames:
    """Count of consecutive camera frames in which a condition holds.

    Args:
        required: Number of frames, >= 1.
    """

    def __init__(self, required: int) -> None:
        self.required, self.count = required, 0

    def update(self, condition: bool) -> bool:
        """Process one frame; return whether the condition has held in the last `required` frames."""
        self.count = self.count + 1 if condition else 0
        return self.count >= self.required


class YawRateGate:
    """Gate that is closed during and shortly after turns, because ego rotation moves the whole image.

    Args:
        yaw_rate: Absolute yaw rate above which the car turns [rad/s].
        settle: Number of latest camera frames that must be free of turning for the gate to be open.
    """

    def __init__(self, yaw_rate: float, settle: int) -> None:
        self.yaw_rate, self.settle = yaw_rate, settle
        self._remaining = 0

    def update(self, yaw_rate: float) -> bool:
        """Process the yaw rate of one frame [rad/s]; return whether the gate is open."""
        turning = abs(yaw_rate) > self.yaw_rate
        self._remaining = self.settle if turning else max(self._remaining - 1, 0)
        return self._remaining == 0

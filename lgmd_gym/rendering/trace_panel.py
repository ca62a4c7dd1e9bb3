"""SpikeTracePanel: panel of the spike raster and the spike frequency."""

from collections import deque
from itertools import pairwise

from lgmd_gym.rendering.canvas import FAINT, INK, UNLIT, YELLOW, Box, Canvas, Colour

RASTER: Box = (76, 562, 644, 590)
PLOT: Box = (76, 594, 644, 694)
SPAN = 5.0  # [s] of history
CEILINGS = (2, 4, 6, 8, 10, 20, 40)  # upper ends of the frequency axis, as multiples of the alert level


class SpikeTracePanel:
    """Spikes and spike frequencies of the last seconds.

    Args:
        level: Alert level T_sf [spikes/s].
        names: Names of the traces.
        colours: Colours of the traces.
    """

    def __init__(self, level: float, names: list[str], colours: list[Colour]) -> None:
        self.level, self.names, self.colours = level, names, colours
        self._frames: deque[tuple[float, list[float], int]] = deque()
        self._time = 0.0

    def __len__(self) -> int:
        """Return the number of camera frames in the trace."""
        return len(self._frames)

    def clear(self) -> None:
        """Discard the trace."""
        self._frames.clear()
        self._time = 0.0

    def add(self, time: float, frequencies: list[float], spikes: int) -> None:
        """Add the outputs for one camera frame.

        Args:
            time: Time since the reset [s].
            frequencies: Spike frequency of each trace [spikes/s].
            spikes: Largest number of spikes of any neuron in this frame.
        """
        self._time = time
        self._frames.append((time, frequencies, spikes))
        while self._frames[0][0] < time - SPAN:
            self._frames.popleft()

    def draw(self, canvas: Canvas, potential: float) -> None:
        """Draw axes, spike raster, frequencies and alert level.

        Args:
            canvas: Canvas to draw on.
            potential: Current membrane potential K.
        """
        left, top, right, bottom = PLOT
        highest = max((max(values) for _, values, _ in self._frames), default=0.0)
        ceilings = (n * self.level for n in CEILINGS if n * self.level >= max(highest, 100.0))
        ceiling = next(ceilings, CEILINGS[-1] * self.level)
        start = max(self._time - SPAN, 0.0)

        def place(time: float, value: float) -> tuple[float, float]:
            x = left + (time - start) / SPAN * (right - left)
            return x, bottom - 1 - min(value / ceiling, 1.0) * (bottom - top - 2)

        for second in range(int(start) + 1, int(start + SPAN) + 1):
            x = place(second, 0.0)[0]
            canvas.rectangle((round(x), top, round(x) + 1, bottom), UNLIT)
            canvas.text((x, bottom + 3), f"{second} s", 13, FAINT, "ma")
        for value in (0.0, self.level, ceiling):
            canvas.text((left - 8, place(start, value)[1]), f"{value:g}", 14, FAINT, "rm")
        level = round(place(start, self.level)[1])
        canvas.rectangle((left, level, right, level + 2), YELLOW)
        for time, _, spikes in self._frames:
            _draw_stroke(canvas, place(time, 0.0)[0], spikes)
        for index, colour in enumerate(self.colours):
            points = [place(time, values[index]) for time, values, _ in self._frames]
            for point, next_point in pairwise(points):
                canvas.lines([point, next_point], colour, 3)
        canvas.text((left + 8, level - 18), f"alert level {self.level:g} spikes/s", 13, YELLOW)
        self._draw_heading(canvas, potential)

    def draw_background(self, canvas: Canvas) -> None:
        """Draw the constant parts: outlines and the name of the raster."""
        for box in (RASTER, PLOT):
            canvas.rectangle(box, (12, 13, 16))
            canvas.frame(box, UNLIT)
        canvas.text((RASTER[0] - 8, (RASTER[1] + RASTER[3]) / 2), "spikes", 14, FAINT, "rm")

    def _draw_heading(self, canvas: Canvas, potential: float) -> None:
        frequencies = self._frames[-1][1] if self._frames else [0.0] * len(self.names)
        x = float(PLOT[0])
        for name, colour, value in zip(self.names, self.colours, frequencies, strict=True):
            label = f"{value:3.0f} spikes/s" if len(self.names) == 1 else f"{name} {value:.0f}"
            canvas.rectangle((round(x), 546, round(x) + 18, 550), colour)
            canvas.text((x + 24, 548), label, 15, anchor="lm")
            x += 150.0
        canvas.text((PLOT[2], 548), f"potential K {potential:.2f}", 15, FAINT, "rm")


def _draw_stroke(canvas: Canvas, x: float, spikes: int) -> None:
    """Draw the spikes of a camera frame as a stroke, whose height is proportional up to 10 spikes."""
    if spikes > 0:
        height = max(round((RASTER[3] - RASTER[1]) * min(spikes, 10) / 10), 4)
        canvas.rectangle((round(x) - 1, RASTER[3] - height, round(x) + 1, RASTER[3]), INK)

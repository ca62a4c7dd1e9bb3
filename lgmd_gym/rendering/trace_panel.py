"""The panel of the spike raster and the spike frequency."""

from collections import deque
from itertools import pairwise

from lgmd_gym.rendering.canvas import FAINT, INK, UNLIT, YELLOW, Box, Canvas, Colour

RASTER: Box = (76, 562, 644, 590)
PLOT: Box = (76, 594, 644, 694)
SPAN = 5.0  # [s] of history
CEILINGS = (2, 4, 6, 8, 10, 20, 40)  # times the alert level


class Trace:
    """The last seconds of one or more neurons.

    Args:
        level: Their alert level T_sf [spikes/s].
        names: Of the cameras.
        colours: One per camera.
    """

    def __init__(self, level: float, names: list[str], colours: list[Colour]) -> None:
        self.level, self.names, self.colours = level, names, colours
        self._seen: deque[tuple[float, list[float], int]] = deque()
        self._time = 0.0

    def clear(self) -> None:
        """Forget everything."""
        self._seen.clear()
        self._time = 0.0

    def add(self, time: float, frequencies: list[float], spikes: int) -> None:
        """Take the answer to one camera frame.

        Args:
            time: Since the reset [s].
            frequencies: Of each camera's neuron [spikes/s].
            spikes: At this frame, the most of any neuron.
        """
        self._time = time
        self._seen.append((time, frequencies, spikes))
        while self._seen[0][0] < time - SPAN:
            self._seen.popleft()

    def draw(self, canvas: Canvas, potential: float) -> None:
        """Draw raster, frequency and alert level.

        Args:
            canvas: Where.
            potential: The present membrane potential K, for the heading.
        """
        left, top, right, bottom = PLOT
        highest = max((max(values) for _, values, _ in self._seen), default=0.0)
        room = (n * self.level for n in CEILINGS if n * self.level >= max(highest, 100.0))
        ceiling = next(room, CEILINGS[-1] * self.level)
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
        self._draw_strokes(canvas, [(place(time, 0.0)[0], spikes) for time, _, spikes in self._seen])
        for index, colour in enumerate(self.colours):
            points = [place(time, values[index]) for time, values, _ in self._seen]
            for one, next_one in pairwise(points):
                canvas.lines([one, next_one], colour, 3)
        canvas.text((left + 8, level - 18), f"alert level {self.level:g} spikes/s", 13, YELLOW)
        self._draw_heading(canvas, potential)

    def _draw_strokes(self, canvas: Canvas, strokes: list[tuple[float, int]]) -> None:
        """Draw the raster: a stroke per camera frame, as tall as it has spikes (up to 10)."""
        tall = RASTER[3] - RASTER[1]
        for x, spikes in strokes:
            if spikes > 0:
                height = round(tall * min(spikes, 10) / 10)
                canvas.rectangle((round(x) - 1, RASTER[3] - max(height, 4), round(x) + 1, RASTER[3]), INK)

    def _draw_heading(self, canvas: Canvas, potential: float) -> None:
        frequencies = self._seen[-1][1] if self._seen else [0.0] * len(self.names)
        x = float(PLOT[0])
        for name, colour, value in zip(self.names, self.colours, frequencies, strict=True):
            label = f"{value:3.0f} spikes/s" if len(self.names) == 1 else f"{name} {value:.0f}"
            canvas.rectangle((round(x), 546, round(x) + 18, 550), colour)
            canvas.text((x + 24, 548), label, 15, anchor="lm")
            x += 150.0
        canvas.text((PLOT[2], 548), f"potential K {potential:.2f}", 15, FAINT, "rm")


def draw_frame(canvas: Canvas) -> None:
    """Draw what never changes: outlines and the raster's name."""
    for box in (RASTER, PLOT):
        canvas.rectangle(box, (12, 13, 16))
        canvas.frame(box, UNLIT)
    canvas.text((RASTER[0] - 8, (RASTER[1] + RASTER[3]) / 2), "spikes", 14, FAINT, "rm")

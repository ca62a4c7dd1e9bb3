"""The overlay video: the clip with the neuron's excitation on it, its spikes, and the alert lamp."""

from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from lgmd_gym.neuron import LGMD
from lgmd_gym.video import VideoWriter
from lgmd_gym.video.clips.playback import Choice, Moment

WIDTH, TALLEST, PANEL = 960, 720, 210  # [px]
SPAN = 5.0  # [s] of history in the trace
HOT = 60.0  # excitation G that is painted at full strength
INK, FAINT, GROUND, UNLIT = (235, 235, 235), (150, 154, 162), (20, 22, 26), (45, 48, 54)
BLUE, ORANGE, PINK = (86, 180, 233), (230, 159, 0), (204, 121, 167)


class Overlay:
    """Writes one picture per moment of a watched clip; use it in a `with` block.

    Args:
        path: The video file, which must not exist.
        title: Shown at the bottom.
        fps: Frames per second.
        choice: How the clip is watched.
        crash_s: Time of the crash [s]; None for none.
    """

    def __init__(self, path: Path, title: str, fps: float, choice: Choice, crash_s: float | None) -> None:
        self.title, self.choice, self.crash_s = title, choice, crash_s
        self._fps = fps
        self._writer = VideoWriter(path, fps)
        self._history: deque[tuple[float, float, int]] = deque()
        self._fonts = {size: _font(size) for size in (13, 16, 22)}

    def write(self, moment: Moment, neuron: LGMD) -> None:
        """Append the picture of one moment."""
        r = moment.response
        self._history.append((moment.time, r.spike_frequency, r.spikes))
        while self._history[0][0] < moment.time - SPAN:
            self._history.popleft()
        self._writer.write(self.draw(moment, neuron.layers["G"]))

    def draw(self, moment: Moment, excitation: np.ndarray) -> np.ndarray:
        """Return the picture of one moment, RGB, uint8.

        Args:
            moment: What was seen and answered.
            excitation: The G layer, shape (H, W).
        """
        height, width = moment.picture.shape[:2]
        scale = min(WIDTH / width, TALLEST / height)
        size = max(round(width * scale), 1), max(round(height * scale), 1)
        tall = size[1] + size[1] % 2
        canvas = Image.new("RGB", (WIDTH, tall + PANEL), GROUND)
        left = (WIDTH - size[0]) // 2
        hot = _heated(moment.picture, excitation)
        canvas.paste(Image.fromarray(hot).resize(size, Image.Resampling.BILINEAR), (left, 0))
        pen = ImageDraw.Draw(canvas)
        if self.choice.roi is not None:
            top, start, high, wide = (value * scale for value in self.choice.roi)
            pen.rectangle((left + start, top, left + start + wide, top + high), outline=BLUE, width=2)
        self._draw_lamp(pen, moment)
        self._draw_trace(pen, moment, (70, tall + 44, WIDTH - 16, tall + PANEL - 28))
        note = "orange in the picture: excitation G, what the neuron finds looming"
        self._text(pen, (70, tall + PANEL - 22), note, 13, fill=FAINT)
        self._text(pen, (WIDTH - 16, tall + PANEL - 22), self.title, 13, fill=FAINT, anchor="ra")
        return np.asarray(canvas)

    def __enter__(self) -> "Overlay":
        return self

    def __exit__(self, *_: Any) -> None:
        self._writer.close()

    def _text(
        self, pen: ImageDraw.ImageDraw, at: tuple[float, float], text: str, size: int, **look: Any
    ) -> None:
        pen.text(at, text, font=self._fonts[size], **{"fill": INK, **look})

    def _draw_lamp(self, pen: ImageDraw.ImageDraw, moment: Moment) -> None:
        """Draw the alert lamp, and the crash once it has come."""
        lit = bool(moment.response.alert)
        pen.rounded_rectangle((16, 14, 176, 56), 8, fill=ORANGE if lit else UNLIT)
        self._text(pen, (96, 35), "ALERT", 22, fill=(0, 0, 0) if lit else FAINT, anchor="mm")
        if self.crash_s is not None and moment.time >= self.crash_s - 0.5 / self._fps:
            pen.rounded_rectangle((WIDTH - 176, 14, WIDTH - 16, 56), 8, fill=PINK)
            self._text(pen, (WIDTH - 96, 35), "CRASH", 22, fill=(0, 0, 0), anchor="mm")

    def _draw_trace(
        self, pen: ImageDraw.ImageDraw, moment: Moment, box: tuple[float, float, float, float]
    ) -> None:
        """Draw the frequency, its alert level and the spike raster of the last seconds."""
        left, top, right, bottom = box
        level = self.choice.params.t_sf
        ceiling = max(2.0 * level, 150.0, *(value for _, value, _ in self._history))
        start = max(moment.time - SPAN, 0.0)

        def place(time: float, value: float) -> tuple[float, float]:
            x = left + (time - start) / SPAN * (right - left)
            return x, bottom - value / ceiling * (bottom - top - 26)

        pen.rectangle(box, outline=FAINT)
        for value in (0.0, level, ceiling):
            self._text(pen, (left - 6, place(start, value)[1]), f"{value:.0f}", 13, fill=FAINT, anchor="rm")
        height = place(start, level)[1]
        pen.line((left, height, right, height), fill=ORANGE)
        if self.crash_s is not None and start <= self.crash_s <= moment.time:
            pen.line((*place(self.crash_s, 0.0), place(self.crash_s, 0.0)[0], top), fill=PINK, width=2)
        points = [place(time, value) for time, value, _ in self._history]
        if len(points) > 1:
            pen.line(points, fill=BLUE, width=3)
        for time, _, spikes in self._history:  # the raster: a stroke per frame, as long as its spikes
            if spikes > 0:
                x = place(time, 0.0)[0]
                pen.line((x, top + 3, x, top + 3 + 2.2 * min(spikes, 10)), fill=INK)
        r = moment.response
        heading = f"{moment.time:6.2f} s    {r.spike_frequency:.0f} spikes/s    K {r.membrane_potential:.2f}"
        self._text(pen, (left, top - 24), heading, 16)
        about = f"{self.choice.describe(self._fps)};  white strokes: spikes"
        self._text(pen, (right, top - 22), about, 13, fill=FAINT, anchor="ra")


def _heated(picture: np.ndarray, excitation: np.ndarray) -> np.ndarray:
    """Return the picture, a little darker and greyer, with the excitation painted on it in orange."""
    strength = np.clip(excitation / HOT, 0.0, 1.0)[:, :, None] * 0.85
    grey = picture.mean(2, keepdims=True, dtype=np.float32)
    calm = 0.5 * picture + 0.3 * grey
    return (calm + strength * (np.array((255, 120, 0), np.float32) - calm)).astype(np.uint8)


def _font(size: int) -> Any:
    """Return DejaVu Sans, which matplotlib carries."""
    import matplotlib as mpl

    return ImageFont.truetype(f"{mpl.get_data_path()}/fonts/ttf/DejaVuSans.ttf", size)

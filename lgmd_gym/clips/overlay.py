"""The overlay video: the clip with the neuron's excitation, the spike trace and the alert indicator."""

from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from lgmd_gym.clips import VideoWriter
from lgmd_gym.clips.playback import ClipFrame, PlaybackConfig
from lgmd_gym.neuron import LGMD
from lgmd_gym.plotting.style import load_font

WIDTH, MAX_HEIGHT, PANEL = 960, 720, 210  # [px]
SPAN = 5.0  # duration of the trace [s]
FULL_EXCITATION = 60.0  # excitation G with the strongest colour
TEXT, FAINT, BACKGROUND, INACTIVE = (235, 235, 235), (150, 154, 162), (20, 22, 26), (45, 48, 54)
BLUE, ORANGE, PINK = (86, 180, 233), (230, 159, 0), (204, 121, 167)


class OverlayWriter:
    """Write the overlay video of a clip; use it in a `with` block.

    Args:
        path: Video file, which must not exist.
        title: Text at the bottom right.
        fps: Frame rate [Hz].
        config: Neuron parameters and frame processing.
        crash_s: Time of the crash [s]; None for none.
    """

    def __init__(
        self, path: Path, title: str, fps: float, config: PlaybackConfig, crash_s: float | None
    ) -> None:
        self.title, self.config, self.crash_s = title, config, crash_s
        self._fps = fps
        self._writer = VideoWriter(path, fps)
        self._history: deque[tuple[float, float, int]] = deque()
        self._fonts = {size: load_font(size) for size in (13, 16, 22)}

    def write(self, frame: ClipFrame, neuron: LGMD) -> None:
        """Append the picture of one frame."""
        r = frame.response
        self._history.append((frame.time, r.spike_frequency, r.spikes))
        while self._history[0][0] < frame.time - SPAN:
            self._history.popleft()
        self._writer.write(self.draw(frame, neuron.layers["G"]))

    def draw(self, frame: ClipFrame, excitation: np.ndarray) -> np.ndarray:
        """Return the overlay picture of one frame, RGB, uint8.

        Args:
            frame: Frame and response.
            excitation: The G layer, shape (H, W).
        """
        height, width = frame.picture.shape[:2]
        scale = min(WIDTH / width, MAX_HEIGHT / height)
        size = max(round(width * scale), 1), max(round(height * scale), 1)
        tall = size[1] + size[1] % 2
        canvas = Image.new("RGB", (WIDTH, tall + PANEL), BACKGROUND)
        left = (WIDTH - size[0]) // 2
        blended = _blend(frame.picture, excitation)
        canvas.paste(Image.fromarray(blended).resize(size, Image.Resampling.BILINEAR), (left, 0))
        pen = ImageDraw.Draw(canvas)
        if self.config.roi is not None:
            top, start, roi_height, roi_width = (value * scale for value in self.config.roi)
            corners = (left + start, top, left + start + roi_width, top + roi_height)
            pen.rectangle(corners, outline=BLUE, width=2)
        self._draw_indicators(pen, frame)
        self._draw_trace(pen, frame, (70, tall + 44, WIDTH - 16, tall + PANEL - 28))
        note = "orange: excitation G of the neuron, high for looming objects"
        self._text(pen, (70, tall + PANEL - 22), note, 13, fill=FAINT)
        self._text(pen, (WIDTH - 16, tall + PANEL - 22), self.title, 13, fill=FAINT, anchor="ra")
        return np.asarray(canvas)

    def __enter__(self) -> "OverlayWriter":
        return self

    def __exit__(self, *_: Any) -> None:
        self._writer.close()

    def _text(
        self, pen: ImageDraw.ImageDraw, at: tuple[float, float], text: str, size: int, **style: Any
    ) -> None:
        pen.text(at, text, font=self._fonts[size], **{"fill": TEXT, **style})

    def _draw_indicators(self, pen: ImageDraw.ImageDraw, frame: ClipFrame) -> None:
        """Draw the alert indicator, and from the crash on the crash indicator."""
        alert = bool(frame.response.alert)
        pen.rounded_rectangle((16, 14, 176, 56), 8, fill=ORANGE if alert else INACTIVE)
        self._text(pen, (96, 35), "ALERT", 22, fill=(0, 0, 0) if alert else FAINT, anchor="mm")
        if self.crash_s is not None and frame.time >= self.crash_s - 0.5 / self._fps:
            pen.rounded_rectangle((WIDTH - 176, 14, WIDTH - 16, 56), 8, fill=PINK)
            self._text(pen, (WIDTH - 96, 35), "CRASH", 22, fill=(0, 0, 0), anchor="mm")

    def _draw_trace(
        self, pen: ImageDraw.ImageDraw, frame: ClipFrame, box: tuple[float, float, float, float]
    ) -> None:
        """Draw the frequency, its alert level and the spike raster of the last `SPAN` seconds."""
        left, top, right, bottom = box
        level = self.config.params.t_sf
        ceiling = max(2.0 * level, 150.0, *(value for _, value, _ in self._history))
        start = max(frame.time - SPAN, 0.0)

        def place(time: float, value: float) -> tuple[float, float]:
            x = left + (time - start) / SPAN * (right - left)
            return x, bottom - value / ceiling * (bottom - top - 26)

        pen.rectangle(box, outline=FAINT)
        for value in (0.0, level, ceiling):
            self._text(pen, (left - 6, place(start, value)[1]), f"{value:.0f}", 13, fill=FAINT, anchor="rm")
        height = place(start, level)[1]
        pen.line((left, height, right, height), fill=ORANGE)
        if self.crash_s is not None and start <= self.crash_s <= frame.time:
            pen.line((*place(self.crash_s, 0.0), place(self.crash_s, 0.0)[0], top), fill=PINK, width=2)
        points = [place(time, value) for time, value, _ in self._history]
        if len(points) > 1:
            pen.line(points, fill=BLUE, width=3)
        for (
            time,
            _,
            spikes,
        ) in self._history:  # one line per frame, its length proportional to the number of spikes
            if spikes > 0:
                x = place(time, 0.0)[0]
                pen.line((x, top + 3, x, top + 3 + 2.2 * min(spikes, 10)), fill=TEXT)
        r = frame.response
        heading = f"{frame.time:6.2f} s    {r.spike_frequency:.0f} spikes/s    K {r.membrane_potential:.2f}"
        self._text(pen, (left, top - 24), heading, 16)
        legend = f"{self.config.describe(self._fps)};  white lines: spikes"
        self._text(pen, (right, top - 22), legend, 13, fill=FAINT, anchor="ra")


def _blend(picture: np.ndarray, excitation: np.ndarray) -> np.ndarray:
    """Return the picture, darkened and partly desaturated, with the excitation in orange."""
    strength = np.clip(excitation / FULL_EXCITATION, 0.0, 1.0)[:, :, None] * 0.85
    grey = picture.mean(2, keepdims=True, dtype=np.float32)
    muted = 0.5 * picture + 0.3 * grey
    return (muted + strength * (np.array((255, 120, 0), np.float32) - muted)).astype(np.uint8)

"""The overlay video of a clip, and its figure; matplotlib is imported on first use."""

from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from lgmd_gym.clips.playback import BINS, ClipFrame, ClipSummary, PlaybackConfig
from lgmd_gym.clips.video import VideoWriter
from lgmd_gym.neuron import FrameNeuron
from lgmd_gym.plotting.style import COLOURS, STYLE, load_font, load_pyplot

WIDTH, MAX_HEIGHT, PANEL = 960, 720, 210  # [px]
SPAN = 5.0  # duration of the trace [s]
FULL_LAYER = 64.0  # of G in `shown_layers`
FULL_EXCITATION = 60.0  # excitation G with the strongest colour
TEXT, FAINT, BACKGROUND, INACTIVE = (235, 235, 235), (150, 154, 162), (20, 22, 26), (45, 48, 54)
BLUE, ORANGE, PINK = (86, 180, 233), (230, 159, 0), (204, 121, 167)


class OverlayWriter:
    """Write the overlay video of a clip to a new file; use it in a `with` block."""

    def __init__(
        self, path: Path, title: str, fps: float, config: PlaybackConfig, crash_s: float | None
    ) -> None:
        self.title, self.config, self.crash_s = title, config, crash_s
        self._fps = fps
        self._writer = VideoWriter(path, fps)
        self._history: deque[tuple[float, float, int]] = deque()
        self._fonts = {size: load_font(size) for size in (13, 16, 22)}

    def write(self, frame: ClipFrame, neuron: FrameNeuron) -> None:
        """Append the picture of one frame."""
        r = frame.response
        self._history.append((frame.time, r.spike_frequency, r.spikes))
        while self._history[0][0] < frame.time - SPAN:
            self._history.popleft()
        self._writer.write(self.draw(frame, _excitation(neuron)))

    def draw(self, frame: ClipFrame, excitation: np.ndarray) -> np.ndarray:
        """Return the overlay picture of one frame, RGB, uint8.

        Args:
            frame: Frame and response.
            excitation: Map of the excitation, shape (H, W).
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

    def __exit__(self, *_: object) -> None:
        self._writer.close()

    def _text(
        self,
        pen: ImageDraw.ImageDraw,
        at: tuple[float, float],
        text: str,
        size: int,
        fill: tuple[int, int, int] = TEXT,
        anchor: str = "la",
    ) -> None:
        pen.text(at, text, font=self._fonts[size], fill=fill, anchor=anchor)

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
        for time, _, spikes in self._history:  # one line per frame, as long as it has spikes
            if spikes > 0:
                x = place(time, 0.0)[0]
                pen.line((x, top + 3, x, top + 3 + 2.2 * min(spikes, 10)), fill=TEXT)
        r = frame.response
        heading = f"{frame.time:6.2f} s    {r.spike_frequency:.0f} spikes/s    K {r.membrane_potential:.2f}"
        self._text(pen, (left, top - 24), heading, 16)
        legend = f"{self.config.describe(self._fps)};  white lines: spikes"
        self._text(pen, (right, top - 22), legend, 13, fill=FAINT, anchor="ra")


def _excitation(neuron: FrameNeuron) -> np.ndarray:
    """Return the last layer that pictures show and that has the shape of the frame, on the scale of G."""
    layers = neuron.layers
    for name, layer in reversed(list(neuron.shown_layers.items())):
        if layers[name].shape == neuron.shape:
            return layers[name] * np.float32(FULL_LAYER / layer.full)
    return np.zeros(neuron.shape, np.float32)


def _blend(picture: np.ndarray, excitation: np.ndarray) -> np.ndarray:
    """Return the picture, darkened and partly desaturated, with the excitation in orange."""
    strength = np.clip(excitation / FULL_EXCITATION, 0.0, 1.0)[:, :, None] * 0.85
    grey = picture.mean(2, keepdims=True, dtype=np.float32)
    muted = 0.5 * picture + 0.3 * grey
    return (muted + strength * (np.array((255, 120, 0), np.float32) - muted)).astype(np.uint8)


MAX_PICTURES = 5


def clip_figure(
    path: Path, title: str, summary: ClipSummary, config: PlaybackConfig, crash_s: float | None
) -> None:
    """Draw pictures at the alarms and the time series of F, K, spikes and spike frequency."""
    plt = load_pyplot()
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=(9.0, 8.6), layout="constrained")
        figure.suptitle(f"{title}   ({config.describe(summary.fps)})", fontsize=10)
        grid = figure.add_gridspec(5, 1, height_ratios=(1.35, 1, 1, 0.55, 1.2))
        _draw_pictures(figure, grid[0], summary.pictures()[-MAX_PICTURES:])
        bottom = figure.add_subplot(grid[4])
        axes = [figure.add_subplot(grid[row], sharex=bottom) for row in (1, 2, 3)]
        series = summary.series()
        _draw_series([*axes, bottom], series, config)
        for axis in (*axes, bottom):
            for label, time, _ in summary.pictures():
                if label == "alarm begins":
                    axis.axvline(time, color=COLOURS[5], linewidth=1.0, alpha=0.8)
            if crash_s is not None:
                axis.axvline(crash_s, color=COLOURS[4], linewidth=1.6, linestyle="--")
        for axis in axes:
            axis.tick_params(labelbottom=False)
        if crash_s is not None:
            _annotate(bottom, (crash_s, 0.97), " crash", COLOURS[4])
        bottom.set_xlabel("time [s]   (orange: an alarm begins after 1/3 s without alarm)")
        bottom.set_xlim(0.0, max(float(series["time"][-1]), 1.0 / summary.fps))
        figure.savefig(path)
        plt.close(figure)


def _draw_pictures(figure: Any, cell: Any, pictures: list[tuple[str, float, np.ndarray]]) -> None:
    """Draw the pictures side by side."""
    row = cell.subgridspec(1, max(len(pictures), 3))
    for index, (label, time, picture) in enumerate(pictures):
        axis = figure.add_subplot(row[index])
        axis.imshow(picture)
        axis.set_title(f"{label}\n{time:.2f} s", fontsize=8)
        axis.set_axis_off()


def _draw_series(axes: list[Any], series: dict[str, np.ndarray], config: PlaybackConfig) -> None:
    """Draw F, K, spikes and frequency, each on its own axes with its threshold."""
    time, p = series["time"], config.params
    inhibition, potential, raster, frequency = axes
    inhibition.plot(time, series["ffi"], color=COLOURS[2])
    inhibition.set_ylabel("F̂, mean change\nof the frame\n[grey levels]")
    threshold = p.sigma_1 * p.t_f
    if np.isfinite(threshold) and series["ffi"].max() > 0.6 * threshold:
        inhibition.axhline(threshold, color="0.5", linestyle=":", linewidth=1.0)
        _annotate(
            inhibition, (0.995, threshold + 0.3), f"inhibition grows above {threshold:g}", "0.4", data="y"
        )
    potential.plot(time, series["membrane_potential"], color=COLOURS[6], label="K")
    potential.plot(time, series["adapted_potential"], color=COLOURS[0], label="K̂, adapted")
    potential.axhline(p.t_sp, color="0.5", linestyle=":", linewidth=1.0)
    _annotate(potential, (0.995, p.t_sp + 0.01), f"first spike at T_sp = {p.t_sp:g}", data="y")
    potential.set_ylim(0.45, 1.02)
    potential.set_ylabel("membrane\npotential")
    potential.legend(loc="upper left", fontsize=8, ncols=2)
    width = 1.0 if len(time) < BINS // 8 else 0.4
    raster.vlines(time, 0.0, series["spikes"], color=COLOURS[0], linewidth=width)
    raster.set_ylabel("spikes\nper frame")
    frequency.plot(time, series["spike_frequency"], color=COLOURS[0])
    alarm = series["spike_frequency"] >= p.t_sf
    frequency.fill_between(time, 0.0, series["spike_frequency"], where=alarm, color=COLOURS[1], alpha=0.35)
    frequency.axhline(p.t_sf, color=COLOURS[1], linestyle="--", linewidth=1.0)
    _annotate(frequency, (0.995, 1.04 * p.t_sf), f"alarm from T_sf = {p.t_sf:g}", COLOURS[1], data="y")
    frequency.set_ylabel("spike frequency\n[spikes/s]")
    for axis in (inhibition, raster, frequency):
        axis.set_ylim(bottom=0.0)


def _annotate(axis: Any, at: tuple[float, float], text: str, colour: str = "0.4", data: str = "x") -> None:
    """Write a small text; the coordinate `data` is in data units, the other a fraction of the axes."""
    if data == "x":
        place = {"xycoords": ("data", "axes fraction"), "va": "top", "ha": "left"}
    else:
        place = {"xycoords": ("axes fraction", "data"), "va": "bottom", "ha": "right"}
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.0}
    axis.annotate(text, at, **place, color=colour, fontsize=8, bbox=box, zorder=4)

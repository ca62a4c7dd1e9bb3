"""Dashboard of 1280×720 pixels: camera frame, layers, spikes, road, bars and lamps."""

from collections import deque
from collections.abc import Mapping
from itertools import pairwise
from math import isfinite
from typing import Any

import numpy as np

from lgmd_gym.camera import EgoCamera
from lgmd_gym.neuron import Layer
from lgmd_gym.rendering.canvas import (
    FAINT,
    GREEN,
    INK,
    PINK,
    PURPLE,
    RED,
    SKY,
    UNLIT,
    YELLOW,
    Canvas,
    Colour,
    PixelBox,
)
from lgmd_gym.rendering.display import DisplayState, danger_zone_edges, target_boxes
from lgmd_gym.rendering.window import dummy_display
from lgmd_gym.wrappers import LGMDObservation, TraceFrame

RASTER: PixelBox = (76, 562, 644, 590)
PLOT: PixelBox = (76, 594, 644, 694)
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


CAMERA_COLOURS = (SKY, INK, PURPLE, GREEN)  # of the traces, in the order of the cameras

CAMERA_FRAME: PixelBox = (24, 60, 824, 510)
INSET = (192, 108)  # [px], size of the inset of each further camera
LAYER_BOXES: tuple[PixelBox, ...] = (
    (848, 60, 1044, 170),
    (1060, 60, 1256, 170),
    (848, 200, 1044, 310),
    (1060, 200, 1256, 310),
)
BARS: PixelBox = (848, 350, 1256, 510)
TOP_VIEW: PixelBox = (668, 562, 1256, 694)
TOP_VIEW_SCALING = 5.5  # [px/m]
TOP_VIEW_CENTRE = (0.3, 0.5)  # position of the ego in the panel, as fractions of its size

LEGEND = (("targets", YELLOW, "bodies ahead"), ("zone", SKY, "danger zone"))


def _palette(first: tuple[int, ...], last: tuple[int, ...]) -> np.ndarray:
    """Return a gradient of 256 colours, uint8, shape (256, 3)."""
    share = np.linspace(0.0, 1.0, 256)[:, None]
    return (np.array(first) * (1.0 - share) + np.array(last) * share).astype(np.uint8)


GREY = np.repeat(np.arange(256, dtype=np.uint8)[:, None], 3, axis=1)
HEAT = _palette((8, 9, 12), (255, 190, 40))
SIGNED = np.concatenate(
    [_palette((86, 180, 233), (8, 9, 12))[::2], _palette((8, 9, 12), (255, 245, 220))[::2]]
)


class CameraPanel:
    """Panel of a camera frame with overlays, and insets of the other cameras.

    Args:
        observer: The observation wrapper.
        overlays: Names of `overlays.OVERLAYS`.
    """

    def __init__(self, observer: LGMDObservation, overlays: tuple[str, ...]) -> None:
        self.observer, self.overlays = observer, overlays

    def draw(self, canvas: Canvas, cameras: list[int]) -> None:
        """Draw the last frames of cameras, given by their indices; the first one is enlarged."""
        frames = list(self.observer.frames.items())
        name, frame = frames[cameras[0]]
        placed = canvas.paste(GREY[frame], CAMERA_FRAME)
        camera = list(self.observer.sensors.cameras[0].values())[cameras[0]]
        if isinstance(camera, EgoCamera):
            self._draw_legend(canvas)
            self._draw_overlays(canvas, camera, placed, frame.shape)
        right = CAMERA_FRAME[2] - 8
        for other, small in [frames[index] for index in cameras[1:]]:
            box = (right - INSET[0], CAMERA_FRAME[3] - 8 - INSET[1], right, CAMERA_FRAME[3] - 8)
            inset = canvas.paste(GREY[small], box)
            canvas.frame(inset, FAINT)
            canvas.tag(((inset[0] + inset[2]) / 2, inset[3] - 14), other, 14)
            right = box[0] - 8
        canvas.text(
            (CAMERA_FRAME[0], CAMERA_FRAME[3] + 5), _caption(camera, name, self.observer.fps), 15, FAINT
        )

    def _draw_legend(self, canvas: Canvas) -> None:
        """Draw the names of the overlays at the right end of the caption."""
        right = CAMERA_FRAME[2]
        for name, colour, label in LEGEND:
            if name in self.overlays:
                canvas.text((right, CAMERA_FRAME[3] + 5), label, 15, colour, "ra")
                right -= 126

    def _draw_overlays(
        self, canvas: Canvas, camera: EgoCamera, placed: PixelBox, shape: tuple[int, ...]
    ) -> None:
        env: Any = self.observer.unwrapped
        scale = (placed[2] - placed[0]) / shape[1]
        origin = np.array(placed[:2], np.float64)
        canvas.clip(placed)
        if "zone" in self.overlays:
            for edge in danger_zone_edges(camera, env.vehicle):
                points = np.clip(edge * scale + origin, -10_000, 10_000)
                canvas.lines(points.tolist(), SKY, 2)
        if "targets" in self.overlays:
            for box in target_boxes(camera, env):
                left, top, right, bottom = (value * scale for value in box)
                _brackets(canvas, origin, (left - 3, top - 3, right + 3, bottom + 3))
        canvas.clip(None)


def draw_layers(canvas: Canvas, shown: Mapping[str, Layer], maps: Mapping[str, np.ndarray]) -> None:
    """Draw the maps of a neuron's last frame and their labels.

    Args:
        canvas: The canvas.
        shown: The maps to draw, `FrameNeuron.shown_layers`; the first four have space.
        maps: The maps by name.
    """
    for (name, layer), box in zip(shown.items(), LAYER_BOXES, strict=False):
        levels = maps[name] * (255.0 / layer.full)
        if layer.signed:
            colours = SIGNED[np.clip(127.5 + 0.5 * levels, 0, 255).astype(np.uint8)]
        else:
            colours = HEAT[np.clip(levels, 0, 255).astype(np.uint8)]
        canvas.paste(colours, box)
        canvas.text((box[0], box[3] + 5), layer.label, 13, FAINT)


# Name, full scale, unit and colour of each bar.
BAR_ROWS = (
    ("speed", 100.0, "km/h", SKY),
    ("gap", 80.0, "m", SKY),
    ("time to contact", 5.0, "s", INK),
    ("braking", 10.0, "m/s²", RED),
)


def draw_bars(canvas: Canvas, state: DisplayState) -> None:
    """Draw speed, gap, time to contact and braking."""
    left, top, right, _ = BARS
    values = (3.6 * state.speed, state.gap, state.ttc, state.deceleration)
    for index, ((name, full, unit, colour), value) in enumerate(zip(BAR_ROWS, values, strict=True)):
        y = top + 42 * index
        canvas.text((left, y), name, 16)
        canvas.text((right, y), f"{value:.1f} {unit}" if isfinite(value) else "–", 16, anchor="ra")
        canvas.rectangle((left, y + 22, right, y + 32), UNLIT)
        if isfinite(value) and value > 0.0:
            canvas.rectangle(
                (left, y + 22, left + round(min(value / full, 1.0) * (right - left)), y + 32), colour
            )


def draw_lamps(canvas: Canvas, state: DisplayState) -> None:
    """Draw the labelled lamps; that of contact shows the impact speed."""
    hit = f"CONTACT {3.6 * state.impact_speed:.0f} km/h" if isfinite(state.impact_speed) else "CONTACT"
    lamps = (
        ("ALERT", state.alert, YELLOW, 760, 890),
        ("BRAKING", state.braking, RED, 902, 1036),
        (hit, state.contact, PINK, 1048, 1256),
    )
    for name, lit, colour, left, right in lamps:
        canvas.pill((left, 12, right, 46), colour if lit else UNLIT)
        canvas.text(((left + right) / 2, 29), name, 16, (0, 0, 0) if lit else FAINT, "mm")


class TopViewPanel:
    """highway-env's top view, for any render mode of the environment.

    Args:
        env: The unwrapped highway-env environment, after its first reset.
    """

    def __init__(self, env: Any) -> None:
        from highway_env.envs.common.graphics import EnvViewer

        changes = {
            "screen_width": TOP_VIEW[2] - TOP_VIEW[0],
            "screen_height": TOP_VIEW[3] - TOP_VIEW[1],
            "scaling": TOP_VIEW_SCALING,
            "centering_position": list(TOP_VIEW_CENTRE),
            "offscreen_rendering": True,
        }
        with dummy_display():
            self._viewer = EnvViewer(env, {**env.config, **changes})
        # highway-env disables drawing for dummy display drivers.
        self._viewer.enabled = True

    def draw(self, canvas: Canvas) -> None:
        """Draw the current road."""
        self._viewer.display()
        canvas.surface.blit(self._viewer.sim_surface, TOP_VIEW[:2])
        x = TOP_VIEW[0] + TOP_VIEW_CENTRE[0] * (TOP_VIEW[2] - TOP_VIEW[0])
        y = TOP_VIEW[1] + TOP_VIEW_CENTRE[1] * (TOP_VIEW[3] - TOP_VIEW[1])
        canvas.tag((x, y - 24), "ego", 14)


def _caption(camera: Any, name: str, fps: float) -> str:
    """Return a one-line description of a camera."""
    params = getattr(camera, "params", None)
    hfov = f", {params.hfov_deg:g}° wide" if params is not None else ""
    height, width = camera.shape
    return f"camera {name}{hfov}, {width}×{height} px at {fps:g} Hz"


def _brackets(canvas: Canvas, origin: np.ndarray, box: tuple[float, float, float, float]) -> None:
    """Draw the four corners of a box."""
    left, top, right, bottom = box
    arm = max(4.0, 0.2 * min(right - left, bottom - top))
    for x, inward in ((left, 1), (right, -1)):
        for y, down in ((top, 1), (bottom, -1)):
            points = [(x + inward * arm, y), (x, y), (x, y + down * arm)]
            shifted = np.clip(np.array(points) + origin, -10_000, 10_000)
            canvas.lines(shifted.tolist(), YELLOW, 2)


SIZE = (1280, 720)
MAX_CAMERAS = len(CAMERA_COLOURS)


class Dashboard:
    """Picture of an observed highway-env environment: camera, layers, spikes, road and display state.

    Args:
        observer: The observation wrapper, after the first reset.
        title: Title at the top.
        overlays: Names of `overlays.OVERLAYS` to draw over the camera frame.
        camera: Name of the camera to enlarge. None for the first one; of more than four cameras, None for
            the one with the highest spike frequency.
    """

    def __init__(
        self, observer: LGMDObservation, title: str, overlays: tuple[str, ...], camera: str | None
    ) -> None:
        names = observer.sensors.names
        self._selected = names.index(camera) if camera is not None else None
        self._enlarged = self._selected or 0
        self._observer, self._title = observer, title
        self._camera_panel = CameraPanel(observer, overlays)
        # More cameras than colours share one trace of the highest frequency.
        self._shared_trace = len(names) > MAX_CAMERAS
        labels = [f"highest of {len(names)}"] if self._shared_trace else names
        colours = list(CAMERA_COLOURS[: len(labels)])
        self._trace_panel = SpikeTracePanel(observer.params.t_sf, labels, colours)
        self._top_view = TopViewPanel(observer.unwrapped)
        self._canvas = self._make_canvas()

    def clear(self) -> None:
        """Discard the trace of the last episode."""
        self._trace_panel.clear()

    def add(self, frames: list[TraceFrame]) -> None:
        """Add the outputs of the neurons for the camera frames of a decision."""
        for frame in frames:
            frequencies = frame.response.spike_frequency.tolist()
            if self._shared_trace:
                frequencies = [max(frequencies)]
            self._trace_panel.add(frame.time, frequencies, int(frame.response.spikes.max()))

    def draw(self, state: DisplayState) -> np.ndarray:
        """Return the current picture as a new array, uint8, shape (720, 1280, 3)."""
        canvas = self._canvas
        canvas.clear()
        canvas.text((712, 29), f"{state.time:.2f} s", 18, anchor="rm")
        cameras = self.ranked_cameras()
        self._enlarged = cameras[0]
        self._camera_panel.draw(canvas, cameras)
        sensors = self._observer.sensors
        draw_layers(canvas, sensors.shown_layers(self._enlarged), sensors.layers(self._enlarged))
        potential = self._observer.response.membrane_potential
        self._trace_panel.draw(canvas, float(potential[self._enlarged]))
        draw_bars(canvas, state)
        self._top_view.draw(canvas)
        draw_lamps(canvas, state)
        return canvas.pixels.copy()

    def ranked_cameras(self) -> list[int]:
        """Return the indices of the displayed cameras, the enlarged one first.

        More than four cameras are ranked by spike frequency; on ties, the enlarged camera stays.
        """
        ranked = list(range(len(self._observer.sensors.names)))
        if self._shared_trace:
            frequencies = self._observer.response.spike_frequency
            ranked.sort(key=lambda index: (-float(frequencies[index]), index != self._enlarged))
        if self._selected is not None:
            ranked.sort(key=lambda index: index != self._selected)
        return ranked[:MAX_CAMERAS]

    def _make_canvas(self) -> Canvas:
        """Return a canvas whose background holds the constant parts."""
        canvas = Canvas(SIZE)
        canvas.clear()
        canvas.text((24, 29), self._title, 18, anchor="lm")
        self._trace_panel.draw_background(canvas)
        canvas.text((TOP_VIEW[0], 548), "top view (highway-env)", 15, FAINT, "lm")
        canvas.save_background()
        return canvas

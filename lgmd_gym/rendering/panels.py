"""Panels of the dashboard: camera frame, layers, bars, lamps and top view."""

from collections.abc import Mapping
from math import isfinite
from typing import Any

import numpy as np

from lgmd_gym.camera import EgoCamera
from lgmd_gym.neuron import Layer
from lgmd_gym.rendering.canvas import FAINT, GREEN, INK, PINK, PURPLE, RED, SKY, UNLIT, YELLOW, Box, Canvas
from lgmd_gym.rendering.overlays import danger_zone_edges, target_boxes
from lgmd_gym.rendering.state import DisplayState
from lgmd_gym.rendering.window import dummy_display
from lgmd_gym.wrappers.observation import LGMDObservation

CAMERA_COLOURS = (SKY, INK, PURPLE, GREEN)  # of the traces, in the order of the cameras

CAMERA_FRAME: Box = (24, 60, 824, 510)
INSET = (192, 108)  # [px], size of the inset of each further camera
LAYER_BOXES: tuple[Box, ...] = (
    (848, 60, 1044, 170),
    (1060, 60, 1256, 170),
    (848, 200, 1044, 310),
    (1060, 200, 1256, 310),
)
BARS: Box = (848, 350, 1256, 510)
TOP_VIEW: Box = (668, 562, 1256, 694)
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

    def _draw_overlays(self, canvas: Canvas, camera: EgoCamera, placed: Box, shape: tuple[int, ...]) -> None:
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

"""The panels of the composed picture: eye, layers, bars, lamps and the view from above."""

from math import isfinite
from typing import Any

import numpy as np

from lgmd_gym.rendering.canvas import FAINT, GREEN, INK, PINK, PURPLE, RED, SKY, UNLIT, YELLOW, Box, Canvas
from lgmd_gym.rendering.overlays import danger_lines, target_boxes
from lgmd_gym.rendering.state import Moment
from lgmd_gym.rendering.window import quiet_start
from lgmd_gym.wrappers.observation import LGMDObservation

CAMERA_COLOURS = (SKY, INK, PURPLE, GREEN)  # one trace each; a fifth camera starts again

EYE: Box = (24, 60, 824, 510)
INSET = (192, 108)  # [px] room for each further camera, inside the eye's panel
LAYERS: dict[str, tuple[str, Box]] = {
    "P": ("P  change, ON and OFF", (848, 60, 1044, 170)),
    "I": ("I  delayed inhibition", (1060, 60, 1256, 170)),
    "S": ("S  excitation left", (848, 200, 1044, 310)),
    "G": ("G  grouped: what looms", (1060, 200, 1256, 310)),
}
LAYER_GAIN = 4.0  # a layer's value of 64 is full brightness
BARS: Box = (848, 350, 1256, 510)
TOP: Box = (668, 562, 1256, 694)
TOP_SCALING = 5.5  # px per m
TOP_CENTRE = (0.3, 0.5)  # where in the panel the ego is

LEGEND = (("targets", YELLOW, "bodies ahead"), ("zone", SKY, "danger zone"))


def _palette(dark: tuple[int, ...], full: tuple[int, ...]) -> np.ndarray:
    """Return 256 colours from one to another, uint8, shape (256, 3)."""
    share = np.linspace(0.0, 1.0, 256)[:, None]
    return (np.array(dark) * (1.0 - share) + np.array(full) * share).astype(np.uint8)


GREY = np.repeat(np.arange(256, dtype=np.uint8)[:, None], 3, axis=1)
HEAT = _palette((8, 9, 12), (255, 190, 40))
SIGNED = np.concatenate(
    [_palette((86, 180, 233), (8, 9, 12))[::2], _palette((8, 9, 12), (255, 245, 220))[::2]]
)


class EyePanel:
    """What a camera sees, with overlays, and the other cameras as insets.

    Args:
        observer: Whose frames are shown.
        overlays: Of `view_overlays.OVERLAYS`.
    """

    def __init__(self, observer: LGMDObservation, overlays: tuple[str, ...]) -> None:
        self.observer, self.overlays = observer, overlays

    def draw(self, canvas: Canvas, cameras: list[int]) -> None:
        """Draw the last frames of these cameras, the first one large."""
        frames = list(self.observer.frames.items())
        name, frame = frames[cameras[0]]
        placed = canvas.paste(GREY[frame], EYE)
        camera = list(self.observer.sensors.sets[0].values())[cameras[0]]
        if self.overlays and hasattr(camera, "project"):
            self._draw_overlays(canvas, camera, placed, frame.shape)
        right = EYE[2] - 8
        for other, small in [frames[index] for index in cameras[1:]]:
            box = (right - INSET[0], EYE[3] - 8 - INSET[1], right, EYE[3] - 8)
            inset = canvas.paste(GREY[small], box)
            canvas.frame(inset, FAINT)
            canvas.tag(((inset[0] + inset[2]) / 2, inset[3] - 14), other, 14)
            right = box[0] - 8
        canvas.text((EYE[0], EYE[3] + 5), _about(camera, name, self.observer.fps), 15, FAINT)
        self._draw_legend(canvas, hasattr(camera, "project"))

    def _draw_legend(self, canvas: Canvas, drawn: bool) -> None:
        """Say what the overlays are, at the right end of the caption."""
        right = EYE[2]
        for name, colour, words in LEGEND:
            if drawn and name in self.overlays:
                canvas.text((right, EYE[3] + 5), words, 15, colour, "ra")
                right -= 126

    def _draw_overlays(self, canvas: Canvas, camera: Any, placed: Box, shape: tuple[int, ...]) -> None:
        host: Any = self.observer.unwrapped
        scale = (placed[2] - placed[0]) / shape[1]
        origin = np.array(placed[:2], np.float64)
        canvas.within(placed)
        if "zone" in self.overlays:
            for edge in danger_lines(camera, host.vehicle):
                points = np.clip(edge * scale + origin, -10_000, 10_000)
                canvas.lines(points.tolist(), SKY, 2)
        if "targets" in self.overlays:
            for box in target_boxes(camera, host):
                left, top, right, bottom = (value * scale for value in box)
                _brackets(canvas, origin, (left - 3, top - 3, right + 3, bottom + 3))
        canvas.within(None)


def draw_layers(canvas: Canvas, maps: dict[str, np.ndarray]) -> None:
    """Draw the maps P, I, S and G of a neuron's last frame."""
    for layer, (_, box) in LAYERS.items():
        values = maps[layer]
        if layer == "P":
            colours = SIGNED[np.clip(127.5 + 0.5 * LAYER_GAIN * values, 0, 255).astype(np.uint8)]
        else:
            colours = HEAT[np.clip(LAYER_GAIN * values, 0, 255).astype(np.uint8)]
        canvas.paste(colours, box)


def draw_layer_names(canvas: Canvas) -> None:
    """Write what the maps are."""
    for name, box in LAYERS.values():
        canvas.text((box[0], box[3] + 5), name, 13, FAINT)


# Name, full scale, unit and colour of each bar.
ROWS = (
    ("speed", 100.0, "km/h", SKY),
    ("gap", 80.0, "m", SKY),
    ("time to contact", 5.0, "s", INK),
    ("braking", 10.0, "m/s²", RED),
)


def draw_bars(canvas: Canvas, moment: Moment) -> None:
    """Draw speed, gap, time to contact and braking."""
    left, top, right, _ = BARS
    values = (3.6 * moment.speed, moment.gap, moment.ttc, moment.deceleration)
    for index, ((name, full, unit, colour), value) in enumerate(zip(ROWS, values, strict=True)):
        y = top + 42 * index
        canvas.text((left, y), name, 16)
        canvas.text((right, y), f"{value:.1f} {unit}" if isfinite(value) else "–", 16, anchor="ra")
        canvas.rectangle((left, y + 22, right, y + 32), UNLIT)
        if isfinite(value) and value > 0.0:
            canvas.rectangle(
                (left, y + 22, left + round(min(value / full, 1.0) * (right - left)), y + 32), colour
            )


def draw_lamps(canvas: Canvas, moment: Moment) -> None:
    """Draw the lamps, each with its word; the last tells how hard the contact was."""
    hit = f"CONTACT {3.6 * moment.impact_speed:.0f} km/h" if isfinite(moment.impact_speed) else "CONTACT"
    lamps = (
        ("ALERT", moment.alert, YELLOW, 760, 890),
        ("BRAKING", moment.braking, RED, 902, 1036),
        (hit, moment.contact, PINK, 1048, 1256),
    )
    for name, lit, colour, left, right in lamps:
        canvas.pill((left, 12, right, 46), colour if lit else UNLIT)
        canvas.text(((left + right) / 2, 29), name, 16, (0, 0, 0) if lit else FAINT, "mm")


class TopPanel:
    """highway-env's own view from above, whatever the environment's render mode.

    Args:
        host: The highway-env environment, after its first reset.
    """

    def __init__(self, host: Any) -> None:
        from highway_env.envs.common.graphics import EnvViewer

        look = {
            "screen_width": TOP[2] - TOP[0],
            "screen_height": TOP[3] - TOP[1],
            "scaling": TOP_SCALING,
            "centering_position": list(TOP_CENTRE),
            "offscreen_rendering": True,
        }
        with quiet_start():
            self._viewer = EnvViewer(host, {**host.config, **look})
        # A dummy display driver must not switch the picture off: nothing is shown by it anyway.
        self._viewer.enabled = True

    def draw(self, canvas: Canvas) -> None:
        """Draw the road as it is now."""
        self._viewer.display()
        canvas.blit(self._viewer.sim_surface, TOP[:2])
        x = TOP[0] + TOP_CENTRE[0] * (TOP[2] - TOP[0])
        y = TOP[1] + TOP_CENTRE[1] * (TOP[3] - TOP[1])
        canvas.tag((x, y - 24), "ego", 14)


def _about(camera: Any, name: str, fps: float) -> str:
    """Return a line on a camera."""
    params = getattr(camera, "params", None)
    lens = f", {params.hfov_deg:g}° wide" if params is not None else ""
    height, width = camera.shape
    return f"the eye: camera {name}{lens}, {width}×{height} px at {fps:g} Hz"


def _brackets(canvas: Canvas, origin: np.ndarray, box: tuple[float, float, float, float]) -> None:
    """Draw the four corners of a box."""
    left, top, right, bottom = box
    arm = max(4.0, 0.2 * min(right - left, bottom - top))
    for x, inward in ((left, 1), (right, -1)):
        for y, down in ((top, 1), (bottom, -1)):
            points = [(x + inward * arm, y), (x, y), (x, y + down * arm)]
            shifted = np.clip(np.array(points) + origin, -10_000, 10_000)
            canvas.lines(shifted.tolist(), YELLOW, 2)

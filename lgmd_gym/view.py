"""The composed picture: what the eye sees, what the neuron says, where the cars are."""

from collections import deque
from typing import Any

import gymnasium as gym
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from lgmd_gym.wrappers import LGMDObservation

WIDTH, HEIGHT = 1280, 720
EYE = (24, 56, 744, 461)  # left, top, right, bottom of the eye's frame: 720 × 405, 16:9
LAYERS = ("P", "I", "S", "G")
LAYER_BOXES = [
    (770 + 246 * (i % 2), 56 + 160 * (i // 2), 1000 + 246 * (i % 2), 185 + 160 * (i // 2)) for i in range(4)
]
TRACE = (84, 520, 744, 690)
BARS = (790, 400, 1246, 560)
TOP = (770, 596, 1256, 696)
SPAN = 5.0  # [s] of history in the trace
# Okabe & Ito's palette on a dark ground.
INK, FAINT, GROUND = (235, 235, 235), (120, 124, 132), (20, 22, 26)
BLUE, ORANGE, RED, GREEN = (86, 180, 233), (230, 159, 0), (213, 94, 0), (0, 158, 115)


class View:
    """Draws one 1280×720 picture per decision of an observed braking environment.

    Args:
        env: A braking environment inside `LGMDObservation`, with `render_mode="rgb_array"` for the top view.
        title: Shown at the top.
    """

    def __init__(self, env: gym.Env, title: str) -> None:
        self.env = env
        self.title = title
        self.eye = find_observer(env)
        self._history: deque[tuple[float, float, float]] = deque()
        self._time = 0.0
        self._fonts = {size: _font(size) for size in (12, 14, 16, 20)}

    def draw(
        self, observation: dict[str, Any], info: dict[str, Any], braking: bool, alert: bool
    ) -> np.ndarray:
        """Return the present picture, uint8, shape (720, 1280, 3).

        Args:
            observation: Of `LGMDObservation`.
            info: Of the same step.
            braking: Whether the agent demands braking.
            alert: Whether the agent warns.
        """
        spikes = float(self.eye.response.spikes.max())
        self._history.append((self._time, float(observation["spike_frequency"].max()), spikes))
        while self._history[0][0] < self._time - SPAN:
            self._history.popleft()
        picture = Image.new("RGB", (WIDTH, HEIGHT), GROUND)
        pen = ImageDraw.Draw(picture)
        self._draw_eye(picture, pen)
        self._draw_layers(picture, pen)
        self._draw_trace(pen, observation)
        self._draw_bars(pen, info)
        self._draw_top(picture, pen)
        self._draw_lamps(pen, info, braking, alert)
        self._time += 1.0 / self.env.unwrapped.config["policy_frequency"]  # type: ignore[attr-defined]
        return np.asarray(picture)

    def _text(
        self, pen: ImageDraw.ImageDraw, at: tuple[float, float], text: str, size: int = 14, **look: Any
    ) -> None:
        pen.text(at, text, font=self._fonts[size], **{"fill": INK, **look})

    def _draw_eye(self, picture: Image.Image, pen: ImageDraw.ImageDraw) -> None:
        name, frame = next(iter(self.eye.frames.items()))
        self._text(pen, (EYE[0], 14), self.title, 20)
        self._text(
            pen, (EYE[0], EYE[3] + 4), f"the eye: camera {name!r}, {self.eye.fps:g} Hz", 12, fill=FAINT
        )
        _paste(picture, frame, EYE)

    def _draw_layers(self, picture: Image.Image, pen: ImageDraw.ImageDraw) -> None:
        maps = self.eye.eyes.layers()
        names = {"P": "P  photoreceptors", "I": "I  inhibition", "S": "S  summation", "G": "G  grouping"}
        for layer, box in zip(LAYERS, LAYER_BOXES, strict=True):
            values = maps[layer]
            if layer == "P":
                grey = np.clip(127.5 + 2.0 * values, 0, 255)
            else:
                grey = np.clip(4.0 * np.abs(values), 0, 255)
            _paste(picture, grey.astype(np.uint8), box)
            self._text(pen, (box[0], box[3] + 3), names[layer], 12, fill=FAINT)

    def _draw_trace(self, pen: ImageDraw.ImageDraw, observation: dict[str, Any]) -> None:
        left, top, right, bottom = TRACE
        level = self.eye.params.t_sf
        ceiling = max(150.0, *(value for _, value, _ in self._history))
        start = max(self._time - SPAN, 0.0)

        def place(time: float, value: float) -> tuple[float, float]:
            return left + (time - start) / SPAN * (right - left), bottom - value / ceiling * (bottom - top)

        pen.rectangle(TRACE, outline=FAINT)
        for value in (0.0, level, ceiling):
            y = place(start, value)[1]
            self._text(pen, (left - 8, y), f"{value:g}", 12, fill=FAINT, anchor="rm")
        y = place(start, level)[1]
        pen.line((left, y, right, y), fill=ORANGE)
        self._text(pen, (right - 6, y - 8), f"alert level T_sf = {level:g}", 12, fill=ORANGE, anchor="rm")
        points = [place(time, value) for time, value, _ in self._history]
        if len(points) > 1:
            pen.line(points, fill=BLUE, width=3)
        for time, _, spikes in self._history:  # the raster: one stroke per frame, as long as its spikes
            if spikes > 0.0:
                x = place(time, 0.0)[0]
                pen.line((x, top + 3, x, top + 3 + 2.0 * spikes), fill=INK)
        potential = float(observation["membrane_potential"].max())
        heading = f"spike frequency {self._history[-1][1]:.0f} spikes/s, potential K {potential:.2f}"
        self._text(pen, (left, top - 22), heading)

    def _draw_bars(self, pen: ImageDraw.ImageDraw, info: dict[str, Any]) -> None:
        left, top, right, _ = BARS
        rows = (
            ("speed", 3.6 * info["ego_speed"], 100.0, "km/h", BLUE),
            ("gap", info["gap"], 80.0, "m", GREEN),
            ("time to contact", info["ttc"], 5.0, "s", GREEN),
            ("braking", info["deceleration"], 10.0, "m/s²", RED),
        )
        for index, (name, value, full, unit, colour) in enumerate(rows):
            y = top + 42 * index
            defined = np.isfinite(value)
            self._text(pen, (left, y), name)
            self._text(pen, (right, y), f"{value:.1f} {unit}" if defined else "–", anchor="ra")
            pen.rectangle((left, y + 20, right, y + 30), fill=(45, 48, 54))
            if defined and value > 0.0:
                pen.rectangle(
                    (left, y + 20, left + min(value / full, 1.0) * (right - left), y + 30), fill=colour
                )

    def _draw_top(self, picture: Image.Image, pen: ImageDraw.ImageDraw) -> None:
        if self.env.unwrapped.render_mode != "rgb_array":
            return
        view = self.env.render()
        self._text(pen, (TOP[0], TOP[3] + 3), "highway-env from above", 12, fill=FAINT)
        _paste(picture, np.asarray(view), TOP)

    def _draw_lamps(self, pen: ImageDraw.ImageDraw, info: dict[str, Any], braking: bool, alert: bool) -> None:
        lamps = (
            ("ALERT", alert, ORANGE),
            ("BRAKING", braking, RED),
            ("CONTACT", info["collision"], (204, 121, 167)),
        )
        for index, (name, lit, colour) in enumerate(lamps):
            x = 770 + 164 * index
            pen.rounded_rectangle((x, 12, x + 150, 44), 8, fill=colour if lit else (45, 48, 54))
            self._text(pen, (x + 75, 28), name, 16, fill=(0, 0, 0) if lit else FAINT, anchor="mm")


def find_observer(env: gym.Env) -> LGMDObservation:
    """Return the `LGMDObservation` among an environment's wrappers, or raise ValueError."""
    layer: Any = env
    while isinstance(layer, gym.Wrapper):
        if isinstance(layer, LGMDObservation):
            return layer
        layer = layer.env
    raise ValueError(f"{env} has no LGMDObservation among its wrappers; wrap it first")


def _font(size: int) -> Any:
    """Return DejaVu Sans, which matplotlib carries and which has the signs that units need."""
    import matplotlib as mpl

    return ImageFont.truetype(f"{mpl.get_data_path()}/fonts/ttf/DejaVuSans.ttf", size)


def _paste(picture: Image.Image, pixels: np.ndarray, box: tuple[int, int, int, int]) -> None:
    """Paste a grey or RGB picture into a box, as large as fits, centred, with hard pixels if enlarged."""
    image = Image.fromarray(pixels)
    width, height = box[2] - box[0], box[3] - box[1]
    scale = min(width / image.width, height / image.height)
    size = max(round(image.width * scale), 1), max(round(image.height * scale), 1)
    method = Image.Resampling.NEAREST if scale > 1.0 else Image.Resampling.BILINEAR
    at = box[0] + (width - size[0]) // 2, box[1] + (height - size[1]) // 2
    picture.paste(image.resize(size, method).convert("RGB"), at)

"""A picture to draw on fast: pygame's shapes and text that is drawn once, straight into one array."""

from functools import lru_cache
from typing import Any

import numpy as np
import pygame
from PIL import ImageFont

Colour = tuple[int, int, int]
Box = tuple[int, int, int, int]  # left, top, right, bottom [px]

# Okabe & Ito's palette, told apart by colour-blind readers, on a dark ground.
INK, FAINT, UNLIT, GROUND = (236, 236, 236), (158, 163, 172), (46, 49, 56), (20, 22, 26)
SKY, RED, GREEN = (86, 180, 233), (229, 100, 20), (0, 130, 90)
PINK, YELLOW, PURPLE = (222, 138, 184), (240, 228, 66), (180, 90, 160)


class Canvas:
    """A picture of a fixed size.

    Text is blended from masks that are made once: it needs no `pygame.font`, which any closed highway-env
    window would take away.

    Args:
        size: (width, height) [px].

    Attributes:
        pixels: The picture, uint8, shape (height, width, 3).
        surface: The same memory for pygame.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        width, height = size
        self.pixels = np.zeros((height, width, 3), np.uint8)
        self.surface = pygame.image.frombuffer(self.pixels, size, "RGB")  # type: ignore[arg-type]
        self._background: np.ndarray | None = None

    def clear(self) -> None:
        """Go back to what `keep` kept."""
        self.pixels[...] = GROUND if self._background is None else self._background

    def keep(self) -> None:
        """Have `clear` go back to the present picture."""
        self._background = self.pixels.copy()

    def text(
        self, at: tuple[float, float], text: str, size: int, colour: Colour = INK, anchor: str = "la"
    ) -> None:
        """Write one line of text.

        Args:
            at: Where its anchor lies [px].
            text: What to write.
            size: Of the font [px].
            colour: RGB.
            anchor: PIL's: l, m or r, then a (ascender) or m (middle).
        """
        mask = _mask(text, size)
        height, width = mask.shape[:2]
        left = round(at[0] - {"l": 0.0, "m": 0.5, "r": 1.0}[anchor[0]] * width)
        top = round(at[1] - {"a": 0.0, "m": 0.5}[anchor[1]] * height)
        room = self.pixels[max(top, 0) : top + height, max(left, 0) : left + width]
        alpha = mask[: room.shape[0], : room.shape[1]]
        room[...] = room + (np.array(colour, np.float32) - room) * alpha

    def tag(self, at: tuple[float, float], text: str, size: int) -> None:
        """Write one line of text on a dark plate, centred, over whatever is there."""
        height, width = _mask(text, size).shape[:2]
        left, top = round(at[0] - width / 2), round(at[1] - height / 2)
        self.pill((left - 5, top, left + width + 5, top + height), GROUND)
        self.text(at, text, size, INK, "mm")

    def rectangle(self, box: Box, colour: Colour) -> None:
        """Fill a rectangle."""
        left, top, right, bottom = box
        self.pixels[max(top, 0) : bottom, max(left, 0) : right] = colour

    def pill(self, box: Box, colour: Colour) -> None:
        """Fill a rectangle with round corners."""
        pygame.draw.rect(self.surface, colour, _rect(box), border_radius=8)

    def frame(self, box: Box, colour: Colour) -> None:
        """Draw the outline of a rectangle."""
        pygame.draw.rect(self.surface, colour, _rect(box), width=1)

    def lines(self, points: list[tuple[float, float]], colour: Colour, width: int = 1) -> None:
        """Draw straight lines from point to point."""
        if len(points) > 1:
            pygame.draw.lines(self.surface, colour, False, points, width)

    def within(self, box: Box | None) -> None:
        """Have shapes (not text) stay inside a box; None ends that."""
        self.surface.set_clip(None if box is None else _rect(box))

    def paste(self, pixels: np.ndarray, box: Box) -> Box:
        """Paste an RGB picture, as large as fits, centred; with hard pixels if it is enlarged.

        Args:
            pixels: uint8, shape (height, width, 3), contiguous.
            box: Where.

        Returns:
            The box that it fills.
        """
        height, width = pixels.shape[:2]
        placed = fit((width, height), box)
        size = placed[2] - placed[0], placed[3] - placed[1]
        small = pygame.image.frombuffer(pixels, (width, height), "RGB")  # type: ignore[arg-type]
        scale = pygame.transform.scale if size[0] >= width else pygame.transform.smoothscale
        scale(small, size, self.surface.subsurface(_rect(placed)))
        return placed

    def blit(self, surface: Any, at: tuple[int, int]) -> None:
        """Copy one of pygame's surfaces as it is."""
        self.surface.blit(surface, at)


def fit(size: tuple[int, int], box: Box) -> Box:
    """Return the largest centred box of the shape of `size` (width, height) inside a box."""
    room = box[2] - box[0], box[3] - box[1]
    scale = min(room[0] / size[0], room[1] / size[1])
    width, height = max(round(size[0] * scale), 1), max(round(size[1] * scale), 1)
    left, top = box[0] + (room[0] - width) // 2, box[1] + (room[1] - height) // 2
    return left, top, left + width, top + height


def _rect(box: Box) -> pygame.Rect:
    return pygame.Rect(box[0], box[1], box[2] - box[0], box[3] - box[1])


@lru_cache(maxsize=2048)
def _mask(text: str, size: int) -> np.ndarray:
    """Return how much ink each pixel of a line of text has, float32, shape (height, width, 1), in [0, 1]."""
    font = _font(size)
    ascent, descent = font.getmetrics()
    mask, (dx, dy) = font.getmask2(text, mode="L")
    width, height = mask.size
    room = np.zeros((ascent + descent, max(dx + width, 1), 1), np.float32)
    ink = np.asarray(list(mask), np.float32).reshape(height, width)[: ascent + descent - dy]
    room[dy : dy + ink.shape[0], dx : dx + width, 0] = ink / 255.0
    return room


@lru_cache
def _font(size: int) -> Any:
    """Return DejaVu Sans, which matplotlib carries and which has the signs that units need."""
    import matplotlib as mpl

    return ImageFont.truetype(f"{mpl.get_data_path()}/fonts/ttf/DejaVuSans.ttf", size)

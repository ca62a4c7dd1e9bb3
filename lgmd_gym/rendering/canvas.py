"""Canvas: a picture in one array, with pygame shapes and cached text."""

from functools import lru_cache

import numpy as np
import pygame

from lgmd_gym.plotting.style import load_font

Colour = tuple[int, int, int]
PixelBox = tuple[int, int, int, int]  # left, top, right, bottom [px]

# The palette of Okabe & Ito, which colour-blind readers can distinguish, on a dark background.
INK, FAINT, UNLIT, BACKGROUND = (236, 236, 236), (158, 163, 172), (46, 49, 56), (20, 22, 26)
SKY, RED, GREEN = (86, 180, 233), (229, 100, 20), (0, 130, 90)
PINK, YELLOW, PURPLE = (222, 138, 184), (240, 228, 66), (180, 90, 160)


class Canvas:
    """A picture of a fixed size.

    Text is blended from cached masks, because closing any highway-env window shuts down `pygame.font`.

    Args:
        size: (width, height) [px].

    Attributes:
        pixels: The picture, uint8, shape (height, width, 3).
        surface: A pygame surface on the same memory.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        width, height = size
        self.pixels = np.zeros((height, width, 3), np.uint8)
        self.surface = pygame.image.frombuffer(self.pixels, size, "RGB")  # type: ignore[arg-type]
        self._saved: np.ndarray | None = None

    def clear(self) -> None:
        """Restore the saved background, or fill with the background colour."""
        self.pixels[...] = BACKGROUND if self._saved is None else self._saved

    def save_background(self) -> None:
        """Save the current picture as the background that `clear` restores."""
        self._saved = self.pixels.copy()

    def text(
        self, at: tuple[float, float], text: str, size: int, colour: Colour = INK, anchor: str = "la"
    ) -> None:
        """Draw one line of text.

        Args:
            at: Position (x, y) of the anchor [px].
            text: Text to draw.
            size: Font size [px].
            colour: RGB colour.
            anchor: Anchor as in PIL: l, m or r, then a (ascender) or m (middle).
        """
        mask = _mask(text, size)
        height, width = mask.shape[:2]
        left = round(at[0] - {"l": 0.0, "m": 0.5, "r": 1.0}[anchor[0]] * width)
        top = round(at[1] - {"a": 0.0, "m": 0.5}[anchor[1]] * height)
        area = self.pixels[max(top, 0) : top + height, max(left, 0) : left + width]
        alpha = mask[: area.shape[0], : area.shape[1]]
        area[...] = area + (np.array(colour, np.float32) - area) * alpha

    def tag(self, at: tuple[float, float], text: str, size: int) -> None:
        """Draw one line of text, centred on a dark plate."""
        height, width = _mask(text, size).shape[:2]
        left, top = round(at[0] - width / 2), round(at[1] - height / 2)
        self.pill((left - 5, top, left + width + 5, top + height), BACKGROUND)
        self.text(at, text, size, INK, "mm")

    def rectangle(self, box: PixelBox, colour: Colour) -> None:
        """Fill a rectangle."""
        left, top, right, bottom = box
        self.pixels[max(top, 0) : bottom, max(left, 0) : right] = colour

    def pill(self, box: PixelBox, colour: Colour) -> None:
        """Fill a rectangle with rounded corners."""
        pygame.draw.rect(self.surface, colour, _rect(box), border_radius=8)

    def frame(self, box: PixelBox, colour: Colour) -> None:
        """Draw the outline of a rectangle."""
        pygame.draw.rect(self.surface, colour, _rect(box), width=1)

    def lines(self, points: list[tuple[float, float]], colour: Colour, width: int = 1) -> None:
        """Draw a polyline."""
        if len(points) > 1:
            pygame.draw.lines(self.surface, colour, False, points, width)

    def clip(self, box: PixelBox | None) -> None:
        """Clip shapes, but not text, to a box; None removes the clipping."""
        self.surface.set_clip(None if box is None else _rect(box))

    def paste(self, pixels: np.ndarray, box: PixelBox) -> PixelBox:
        """Paste an RGB image, centred and scaled to fit a box; enlarged images are not smoothed.

        Args:
            pixels: Contiguous image, uint8, shape (height, width, 3).
            box: PixelBox to fit.

        Returns:
            The box of the scaled image.
        """
        height, width = pixels.shape[:2]
        placed = fit_box((width, height), box)
        size = placed[2] - placed[0], placed[3] - placed[1]
        source = pygame.image.frombuffer(pixels, (width, height), "RGB")  # type: ignore[arg-type]
        scale = pygame.transform.scale if size[0] >= width else pygame.transform.smoothscale
        scale(source, size, self.surface.subsurface(_rect(placed)))
        return placed


def fit_box(size: tuple[int, int], box: PixelBox) -> PixelBox:
    """Return the largest centred box with the aspect ratio of `size` (width, height) inside a box."""
    available = box[2] - box[0], box[3] - box[1]
    scale = min(available[0] / size[0], available[1] / size[1])
    width, height = max(round(size[0] * scale), 1), max(round(size[1] * scale), 1)
    left, top = box[0] + (available[0] - width) // 2, box[1] + (available[1] - height) // 2
    return left, top, left + width, top + height


def _rect(box: PixelBox) -> pygame.Rect:
    return pygame.Rect(box[0], box[1], box[2] - box[0], box[3] - box[1])


@lru_cache(maxsize=2048)
def _mask(text: str, size: int) -> np.ndarray:
    """Return the coverage of a line of text, float32, shape (height, width, 1), in [0, 1]."""
    font = load_font(size)
    ascent, descent = font.getmetrics()
    bitmap, (dx, dy) = font.getmask2(text, mode="L")
    width, height = bitmap.size
    mask = np.zeros((ascent + descent, max(dx + width, 1), 1), np.float32)
    values = [bitmap[k] for k in range(height * width)]  # a C object without the buffer protocol
    coverage = np.asarray(values, np.float32).reshape(height, width)[: ascent + descent - dy]
    mask[dy : dy + coverage.shape[0], dx : dx + width, 0] = coverage / 255.0
    return mask

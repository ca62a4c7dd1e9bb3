"""Live window for pictures.

Gymnasium's `HumanRendering` has no title, ignores the close button and Escape, shuts down pygame for all
other viewers of the process, and silently runs without a display.
"""

import os
import sys
from collections.abc import Generator
from contextlib import contextmanager

import numpy as np
import pygame

INVISIBLE_DRIVERS = ("dummy", "offscreen", "evdev")  # SDL video drivers without a visible window
DISPLAY_VARIABLES = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")


class Window:
    """Pygame window that shows RGB pictures in real time; Escape or the close button closes it.

    Args:
        title: Title of the window.
        size: (width, height) [px].
        fps: Pictures per second [Hz].

    Raises:
        ValueError: If there is no display.
    """

    def __init__(self, title: str, size: tuple[int, int], fps: float) -> None:
        self.open = True
        self._fps = fps
        check_display()
        self._title: str | None = title
        self._screen = pygame.display.set_mode(size)
        self._clock = pygame.time.Clock()

    def show(self, picture: np.ndarray) -> bool:
        """Show a picture, then wait until the next one is due.

        Args:
            picture: Contiguous image, uint8, shape (height, width, 3).

        Returns:
            Whether the window is still open.
        """
        if not self.open:
            return False
        for event in pygame.event.get():
            escape = event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE
            if event.type == pygame.QUIT or escape:
                self.close()
                return False
        if self._title is not None:  # not earlier, because new highway-env viewers set their own title
            pygame.display.set_caption(self._title)
            self._title = None
        height, width = picture.shape[:2]
        self._screen.blit(pygame.image.frombuffer(picture, (width, height), "RGB"), (0, 0))  # type: ignore[arg-type]
        pygame.display.flip()
        self._clock.tick(self._fps)
        return True

    def close(self) -> None:
        """Close the window; pictures can still be drawn afterwards."""
        if self.open:
            self.open = False
            # Not pygame.display.quit(), because highway-env viewers of this process need the display module.
            if pygame.display.get_init():
                pygame.display.set_mode((1, 1), pygame.HIDDEN)


def check_display() -> str:
    """Return the name of SDL's video driver.

    Raises:
        ValueError: If there is no display, unless SDL_VIDEODRIVER selects an invisible driver.
    """
    fix = "write a file with --video"
    if sys.platform.startswith("linux"):
        fix += ", set DISPLAY, or use xvfb-run"
    if is_headless():
        raise ValueError(f"a window needs a display, got neither DISPLAY nor WAYLAND_DISPLAY; {fix}")
    try:
        pygame.display.init()
        driver = pygame.display.get_driver()
    except pygame.error as error:
        raise ValueError(f"a window needs a display, got the error {str(error)!r}; {fix}") from None
    if driver in INVISIBLE_DRIVERS and os.environ.get("SDL_VIDEODRIVER") not in INVISIBLE_DRIVERS:
        raise ValueError(f"a window needs a display, got the SDL driver {driver!r}; {fix}")
    return driver


def is_headless() -> bool:
    """Return whether this is Linux and no environment variable names a display."""
    return sys.platform.startswith("linux") and not any(map(os.environ.get, DISPLAY_VARIABLES))


@contextmanager
def dummy_display() -> Generator[None, None, None]:
    """Select SDL's dummy driver on a headless machine, to prevent its warnings on stderr."""
    if not is_headless():
        yield
        return
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    try:
        yield
    finally:
        del os.environ["SDL_VIDEODRIVER"]

"""A window for pictures, at a steady pace; or a clear word where there is no display."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pygame

NO_SCREEN = ("dummy", "offscreen", "evdev")  # SDL's drivers that show nothing


class Window:
    """A pygame window that shows RGB pictures in real time. Escape or its close button ends it.

    Args:
        title: In its bar.
        size: (width, height) [px].
        fps: Pictures per second; `show` waits for the next one's time [Hz].

    Raises:
        ValueError: If there is no display, naming the mend.
    """

    def __init__(self, title: str, size: tuple[int, int], fps: float) -> None:
        self.open = True
        self._fps = fps
        check_display()
        self._title: str | None = title
        self._screen = pygame.display.set_mode(size)
        self._clock = pygame.time.Clock()

    def show(self, picture: np.ndarray) -> bool:
        """Show a picture and wait for the next one's time.

        Args:
            picture: uint8, shape (height, width, 3), contiguous.

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
        if self._title is not None:  # here, since a highway-env viewer writes its own name when it is made
            pygame.display.set_caption(self._title)
            self._title = None
        height, width = picture.shape[:2]
        self._screen.blit(pygame.image.frombuffer(picture, (width, height), "RGB"), (0, 0))  # type: ignore[arg-type]
        pygame.display.flip()
        self._clock.tick(self._fps)
        return True

    def __enter__(self) -> "Window":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the window; pictures may still be drawn."""
        if self.open:
            self.open = False
            # Not pygame.display.quit(): highway-env's viewers in this process need the display module.
            if pygame.display.get_init():
                pygame.display.set_mode((1, 1), pygame.HIDDEN)


def check_display() -> str:
    """Return SDL's display driver.

    Raises:
        ValueError: If it shows nothing, and SDL_VIDEODRIVER does not ask for such a one.
    """
    mend = "write a file with --video"
    if sys.platform.startswith("linux"):
        mend += ", set DISPLAY, or start it under xvfb-run"
    if headless():
        raise ValueError(f"a window needs a display, and neither DISPLAY nor WAYLAND_DISPLAY is set; {mend}")
    try:
        pygame.display.init()
        driver = pygame.display.get_driver()
    except pygame.error as error:
        raise ValueError(f"a window needs a display and there is none ({error}); {mend}") from None
    if driver in NO_SCREEN and os.environ.get("SDL_VIDEODRIVER") not in NO_SCREEN:
        raise ValueError(f"a window needs a display and there is none (SDL's driver is {driver!r}); {mend}")
    return driver


def headless() -> bool:
    """Return whether this is a Linux machine on which nobody named a display."""
    named = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")
    return sys.platform.startswith("linux") and not any(os.environ.get(name) for name in named)


@contextmanager
def quiet_start() -> Iterator[None]:
    """Have SDL start without a display where there is none; it would complain on stderr while it looks."""
    if not headless():
        yield
        return
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    try:
        yield
    finally:
        del os.environ["SDL_VIDEODRIVER"]

"""The composed picture: what the eye sees, what the neuron says, where the cars are."""

import numpy as np

from lgmd_gym.rendering import panels
from lgmd_gym.rendering import trace_panel as view_trace
from lgmd_gym.rendering.canvas import FAINT, Canvas
from lgmd_gym.rendering.overlays import check_overlays
from lgmd_gym.rendering.state import Moment
from lgmd_gym.wrappers.observation import LGMDObservation, TraceFrame

SIZE = (1280, 720)


class Picture:
    """Composes one picture per decision of an observed highway-env environment.

    Args:
        observer: The eye and its neurons, after the first reset.
        title: Shown at the top.
        overlays: What is drawn over the eye's frame: "zone", the danger zone, "targets", boxes around who is
            ahead.
        camera: Name of the camera that is shown large, with its layers; None for the first, or of more
            than four for the one that spikes most.

    Raises:
        ValueError: For an unknown overlay or camera.
    """

    def __init__(
        self, observer: LGMDObservation, title: str, overlays: tuple[str, ...], camera: str | None
    ) -> None:
        names = observer.sensors.names
        self._chosen = names.index(camera) if camera is not None else None
        self._camera = self._chosen or 0
        self._observer, self._title = observer, title
        self._eye = panels.EyePanel(observer, check_overlays(overlays))
        shades = list(panels.CAMERA_COLOURS)
        # More cameras than colours: one trace, the highest of all.
        self._many = len(names) > len(shades)
        shown = [f"highest of {len(names)}"] if self._many else names
        self._trace = view_trace.Trace(observer.params.t_sf, shown, shades[: len(shown)])
        self._top = panels.TopPanel(observer.unwrapped)
        self._canvas = self._make_canvas()

    def clear(self) -> None:
        """Forget the last episode."""
        self._trace.clear()

    def take(self, frames: list[TraceFrame]) -> None:
        """Take the neurons' answers to the camera frames of one decision."""
        for frame in frames:
            response = frame.response
            frequencies = response.spike_frequency.tolist()
            if self._many:
                frequencies = [max(frequencies)]
            self._trace.add(frame.time, frequencies, int(response.spikes.max()))

    def draw(self, moment: Moment) -> np.ndarray:
        """Return the present picture, uint8, shape (720, 1280, 3); a fresh array."""
        canvas = self._canvas
        canvas.clear()
        canvas.text((712, 29), f"{moment.time:.2f} s", 18, anchor="rm")
        ranked = self._ranked()
        self._camera = ranked[0]
        self._eye.draw(canvas, ranked)
        panels.draw_layers(canvas, self._observer.sensors.layers(self._camera))
        potential = self._observer.response.membrane_potential
        self._trace.draw(canvas, float(potential[self._camera]))
        panels.draw_bars(canvas, moment)
        self._top.draw(canvas)
        panels.draw_lamps(canvas, moment)
        return canvas.pixels.copy()

    def _ranked(self) -> list[int]:
        """Return the cameras that there is room for: the large one, then the others.

        Of many cameras the one with the highest spike frequency is shown large, until another's is higher.
        """
        count = len(self._observer.sensors.names)
        order = list(range(count))
        if self._many:
            frequencies = self._observer.response.spike_frequency
            order.sort(key=lambda index: (-float(frequencies[index]), index != self._camera))
        if self._chosen is not None or not self._many:
            large = self._chosen or 0
            order.sort(key=lambda index: index != large)
        return order[: len(panels.CAMERA_COLOURS)]

    def _make_canvas(self) -> Canvas:
        canvas = Canvas(SIZE)
        canvas.clear()
        canvas.text((24, 29), self._title, 18, anchor="lm")
        panels.draw_layer_names(canvas)
        view_trace.draw_frame(canvas)
        canvas.text((panels.TOP[0], 548), "from above, by highway-env", 15, FAINT, "lm")
        canvas.keep()
        return canvas

"""Dashboard: composes camera frame, layers, spikes, road and display state in one picture."""

import numpy as np

from lgmd_gym.rendering import panels
from lgmd_gym.rendering.canvas import FAINT, Canvas
from lgmd_gym.rendering.state import DisplayState
from lgmd_gym.rendering.trace_panel import SpikeTracePanel
from lgmd_gym.wrappers.observation import LGMDObservation, TraceFrame

SIZE = (1280, 720)
MAX_CAMERAS = len(panels.CAMERA_COLOURS)


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
        self._camera_panel = panels.CameraPanel(observer, overlays)
        # More cameras than colours share one trace of the highest frequency.
        self._shared_trace = len(names) > MAX_CAMERAS
        labels = [f"highest of {len(names)}"] if self._shared_trace else names
        colours = list(panels.CAMERA_COLOURS[: len(labels)])
        self._trace_panel = SpikeTracePanel(observer.params.t_sf, labels, colours)
        self._top_view = panels.TopViewPanel(observer.unwrapped)
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
        panels.draw_layers(canvas, sensors.shown_layers(self._enlarged), sensors.layers(self._enlarged))
        potential = self._observer.response.membrane_potential
        self._trace_panel.draw(canvas, float(potential[self._enlarged]))
        panels.draw_bars(canvas, state)
        self._top_view.draw(canvas)
        panels.draw_lamps(canvas, state)
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
        canvas.text((panels.TOP_VIEW[0], 548), "top view (highway-env)", 15, FAINT, "lm")
        canvas.save_background()
        return canvas

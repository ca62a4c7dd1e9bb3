"""Responses of the models to synthetic stimuli: approaches at several l/|v|, and motion without approach."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.comparison.models import SIGNALS, step_models
from lgmd_gym.paper.backgrounds import Grating, Panorama, Plain, Screen
from lgmd_gym.paper.experiments import CONTACT, DARK, FPS, LIGHT
from lgmd_gym.paper.stimuli import (
    Background,
    ForegroundObject,
    Looming,
    Receding,
    Translating,
    stimulus_frames,
)

ALARM = 30.0  # [spikes/s], the alert level at 30 Hz
L_OVER_V = (0.02, 0.05, 0.1, 0.2, 0.3)  # half size over speed of the approaches [s]
APPROACH, RECEDE, TRANSLATE = "approach", "recede", "translate"


class Stimulus(NamedTuple):
    """One stimulus."""

    name: str
    kind: str  # `APPROACH`, `RECEDE`, `TRANSLATE`, or "background"
    background: Background
    foreground: ForegroundObject | None = None
    seconds: float = CONTACT  # duration; of an approach, time to contact [s]
    l_over_v: float = math.nan  # of an approach on a plain background [s]


def stimuli() -> tuple[Stimulus, ...]:
    """Return the stimuli of the comparison."""
    grey, panorama = Plain(), Panorama()
    grating = Grating(spatial=40.0, temporal=2.0, contrast=0.5)
    curves = (
        Stimulus(
            f"approach, l/|v| = {l_over_v:g} s",
            APPROACH,
            grey,
            Looming(l_over_v=l_over_v, contact=max(2.0, 8.0 * l_over_v), largest=85.0),
            max(2.0, 8.0 * l_over_v),
            l_over_v,
        )
        for l_over_v in L_OVER_V
    )
    return (
        *curves,
        Stimulus("dark square approaches", APPROACH, grey, Looming(luminance=DARK)),
        Stimulus("light square approaches", APPROACH, grey, Looming(luminance=LIGHT)),
        Stimulus("dark square recedes", RECEDE, grey, Receding(contact=0.0)),
        Stimulus("passes at 0.108 m/s", TRANSLATE, grey, Translating(centred=1.5)),
        Stimulus("passes at 0.3 m/s", TRANSLATE, grey, Translating(speed=0.3, centred=1.5)),
        Stimulus("panorama alone", "background", panorama),
        Stimulus("approaches in panorama", APPROACH, panorama, Looming()),
        Stimulus("passes in panorama", TRANSLATE, panorama, Translating(centred=1.5)),
        Stimulus("grating alone", "background", grating),
        Stimulus("approaches in grating", APPROACH, grating, Looming()),
    )


class StimulusResult(NamedTuple):
    """Response of one model to one stimulus."""

    model: str
    stimulus: Stimulus
    time: NDArray[np.float64]  # [s], shape (frames,)
    frequency: NDArray[np.float64]  # spike frequency [spikes/s], shape (frames,)
    potential: NDArray[np.float64]  # membrane potential K, shape (frames,)

    @property
    def mean(self) -> float:
        """Mean spike frequency [spikes/s]."""
        return float(self.frequency.mean())

    @property
    def excitation(self) -> float:
        """Mean of K - 0.5 where that is positive."""
        return float(np.maximum(self.potential - 0.5, 0.0).mean())

    @property
    def peak(self) -> float:
        """Highest spike frequency [spikes/s]."""
        return float(self.frequency.max())

    @property
    def lead(self) -> float:
        """Time from the first frame at `ALARM` to contact [s]; NaN without alarm or contact."""
        alarms = self.time[self.frequency >= ALARM]
        if self.stimulus.kind != APPROACH or not len(alarms):
            return math.nan
        return self.stimulus.seconds - float(alarms[0])


def run_stimuli(
    models: Sequence[str],
    chosen: Sequence[Stimulus] | None = None,
    on_step: Callable[[], object] = lambda: None,
) -> list[StimulusResult]:
    """Return the responses of models to stimuli; each stimulus is rendered once.

    Args:
        models: Specifications of the models.
        chosen: The stimuli; None for `stimuli()`.
        on_step: Function called after each stimulus.
    """
    results: list[StimulusResult] = []
    for stimulus in stimuli() if chosen is None else chosen:
        frames = stimulus_frames(Screen(fps=FPS), stimulus.seconds, stimulus.background, stimulus.foreground)
        for model, signals in step_models(models, frames, FPS).items():
            time = np.arange(len(signals["spike_frequency"])) / FPS
            results.append(StimulusResult(model, stimulus, time, *(signals[name] for name in SIGNALS)))
        on_step()
    return results


class Selectivity(NamedTuple):
    """Selectivity of one model for approach on a plain background.

    An index is (a - o) / (a + o), with a the response to the dark square that approaches and o that to the
    other motion: 1 if only the approach causes a response, 0 for equal responses, NaN without any.
    """

    model: str
    recede: float  # index of mean spike frequencies against recession
    translate: float  # against the mean of both passes
    recede_potential: float  # index of `StimulusResult.excitation` against recession
    translate_potential: float  # against the mean of both passes


def selectivity(results: Sequence[StimulusResult]) -> list[Selectivity]:
    """Return the selectivity of each model."""
    found: list[Selectivity] = []
    for model in dict.fromkeys(result.model for result in results):
        of_model = {item.stimulus.name: item for item in results if item.model == model}
        approach, recede = of_model["dark square approaches"], of_model["dark square recedes"]
        passes = of_model["passes at 0.108 m/s"], of_model["passes at 0.3 m/s"]
        spikes, excitation = (
            (
                _index(getattr(approach, name), getattr(recede, name)),
                _index(getattr(approach, name), sum(getattr(item, name) for item in passes) / 2.0),
            )
            for name in ("mean", "excitation")
        )
        found.append(Selectivity(model, *spikes, *excitation))
    return found


def _index(approach: float, other: float) -> float:
    total = approach + other
    return (approach - other) / total if total > 1e-6 else math.nan

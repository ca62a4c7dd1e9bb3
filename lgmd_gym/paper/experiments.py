"""The paper's experiments on synthetic stimuli."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lgmd_gym.neuron import LGMD, LGMDParams, Response
from lgmd_gym.paper.backgrounds import PAPER_SPEED, SHAPES, Grating, Panorama, Plain, Screen
from lgmd_gym.paper.stimuli import (
    DARK,
    LIGHT,
    Background,
    ForegroundObject,
    Frame,
    Looming,
    Receding,
    Translating,
    stimulus_frames,
)

FPS = 30.0
SCREEN = Screen(fps=FPS)
GREY = 127.5
SHADES = {"dark": DARK, "light": LIGHT}
FAST = 0.3  # speed of a fast passing object on the screen [m/s]
# The paper's model and an ablation.
MODELS = {
    "paper": LGMDParams(),
    "fixed inhibition": LGMDParams.fixed_inhibition(),
}
SPATIAL = (1000 / 190, 10.0, 20.0, 40.0, 60.0, 80.0)  # [periods/m]: periods of 190 to 12.5 px
TEMPORAL = (0.5, 1.0, 2.0, 7.0, 14.0)  # [Hz]
CONTRASTS = (0.05, 0.1, 0.2, 0.3, 0.5, 1.0)
L_OVER_V = (0.01, 0.02, 0.03, 0.04, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3)  # [s]
CONTACT = 3.0  # time of contact of the looming object [s]
PICTURE_TIMES = (1.0, 2.3, 2.6, 2.8)  # [s]
StepCallback = Callable[[], object]


@dataclass(frozen=True)
class StimulusResponse:
    """Responses of several models to one stimulus."""

    time: np.ndarray  # time of each frame [s], shape (frames,)
    frequency: dict[str, np.ndarray]  # spike frequency of each model [spikes/s], shape (frames,)
    potential: dict[str, np.ndarray]  # membrane potential K of each model, shape (frames,)
    spikes: dict[str, np.ndarray]  # spikes per frame of each model, shape (frames,)
    ffi: np.ndarray  # F̂ of the first model [grey levels], shape (frames,)
    pictures: list[tuple[float, Frame]]  # (time [s], frame) at selected times

    def times_above(self, level: float, model: str = "paper") -> np.ndarray:
        """Return the times at which the spike frequency is at or above a level [s]."""
        return self.time[self.frequency[model] >= level]

    def peak(self, model: str = "paper") -> float:
        """Return the highest spike frequency [spikes/s]."""
        return float(self.frequency[model].max())


def run_stimulus(
    background: Background,
    foreground: ForegroundObject | None = None,
    seconds: float = CONTACT,
    *,
    screen: Screen = SCREEN,
    models: Mapping[str, LGMDParams] = MODELS,
    picture_times: tuple[float, ...] = (),
) -> StimulusResponse:
    """Run several models on one stimulus.

    Args:
        background: Background.
        foreground: Moving object; None for none.
        seconds: Duration [s].
        screen: Size, frame rate and scale.
        models: Parameters of each model.
        picture_times: Times whose frames are stored [s].
    """
    neurons = {model: LGMD(screen.shape, screen.fps, params) for model, params in models.items()}
    responses: dict[str, list[Response]] = {model: [] for model in models}
    picture_frames = {round(time * screen.fps) for time in picture_times}
    pictures: list[tuple[float, Frame]] = []
    for number, frame in enumerate(stimulus_frames(screen, seconds, background, foreground)):
        if number in picture_frames:
            pictures.append((number / screen.fps, frame))
        for model, neuron in neurons.items():
            responses[model].append(neuron.step(frame))

    def series(field: str) -> dict[str, np.ndarray]:
        return {model: np.array([getattr(r, field) for r in rows]) for model, rows in responses.items()}

    frequency, potential, spikes = map(series, ("spike_frequency", "membrane_potential", "spikes"))
    ffi = next(iter(series("ffi").values()))
    return StimulusResponse(np.arange(len(ffi)) / screen.fps, frequency, potential, spikes, ffi, pictures)


class GratingResponse(NamedTuple):
    """Responses to a grating without an object."""

    grating: Grating
    potential: dict[str, float]  # highest membrane potential K of each model
    ffi: float  # mean F̂ [grey levels]


def gratings(on_step: StepCallback) -> list[GratingResponse]:
    """Return the responses to 30 gratings of full contrast: 6 spatial by 5 temporal frequencies."""
    stimuli = [Grating(spatial=spatial, temporal=rate) for spatial, rate in product(SPATIAL, TEMPORAL)]
    return [grating_response(grating, on_step) for grating in stimuli]


def low_contrast_gratings(on_step: StepCallback) -> list[GratingResponse]:
    """Return the responses to 30 gratings of 40 periods/m: 6 contrasts by 5 temporal frequencies."""
    pairs = product(CONTRASTS, TEMPORAL)
    stimuli = [Grating(spatial=40.0, temporal=rate, contrast=contrast) for contrast, rate in pairs]
    return [grating_response(grating, on_step) for grating in stimuli]


def grating_response(grating: Grating, on_step: StepCallback = lambda: None) -> GratingResponse:
    """Return the responses to one grating of 1.2 s."""
    models = {
        **MODELS,
        "neither adaptation nor silencing": LGMDParams(t_f=math.inf),
        "no warm start": LGMDParams(warm_start=False),
    }
    screen = Screen(shape=SHAPES["gratings"], fps=FPS)
    response = run_stimulus(grating, seconds=1.2, screen=screen, models=models)
    on_step()
    potential = {model: float(values.max()) for model, values in response.potential.items()}
    return GratingResponse(grating, potential, float(response.ffi[1:].mean()))


class LoomingInGrating(NamedTuple):
    """A square that looms in a grating."""

    contrast: float  # contrast of the grating
    spatial: float  # spatial frequency of the grating [periods/m]
    luminance: float  # luminance of the square in 0-255
    response: StimulusResponse  # responses of the models


def looming_in_gratings(on_step: StepCallback) -> list[LoomingInGrating]:
    """Return the responses to squares that loom in gratings of 2 Hz."""
    results: list[LoomingInGrating] = []
    for contrast, spatial, luminance in product((0.2, 0.5, 1.0), (40.0, 60.0, 80.0), (DARK, LIGHT)):
        grating = Grating(spatial=spatial, temporal=2.0, contrast=contrast)
        square = Looming(contact=CONTACT, luminance=luminance)
        response = run_stimulus(grating, square, picture_times=PICTURE_TIMES)
        results.append(LoomingInGrating(contrast, spatial, luminance, response))
        on_step()
    return results


class LuminanceLeads(NamedTuple):
    """Alarm times of a dark and a light square on the same background."""

    background: float  # luminance of the background in 0-255
    dark: float  # time from the first alarm (30 spikes/s) to contact of a dark square [s]
    light: float  # the same for a light square [s]


def light_and_dark(on_step: StepCallback) -> list[LuminanceLeads]:
    """Return the alarm times of dark and light squares on three grey backgrounds at 60 Hz."""

    def lead(background: float, luminance: float) -> float:
        square = Looming(contact=CONTACT, luminance=luminance, l_over_v=0.2)
        response = run_stimulus(Plain(luminance=background), square, screen=Screen(fps=60.0))
        on_step()
        alarms = response.times_above(30.0)
        return CONTACT - float(alarms[0]) if len(alarms) else math.nan

    return [LuminanceLeads(grey, lead(grey, DARK), lead(grey, LIGHT)) for grey in (60.0, GREY, 195.0)]


def panorama(on_step: StepCallback, picture: Path | None = None) -> dict[str, StimulusResponse]:
    """Return the responses to an object that approaches, recedes or translates in a shifting panorama."""
    background = Panorama(picture=picture)
    models = {**MODELS, "T_sp = 0.78": LGMDParams(t_sp=0.78), "sigma_3 = 2": LGMDParams(sigma_3=2.0)}
    objects: dict[str, tuple[ForegroundObject | None, tuple[float, ...]]] = {"panorama alone": (None, (1.5,))}
    for shade, luminance in SHADES.items():
        slow, fast = (Translating(speed=v, centred=1.5, luminance=luminance) for v in (PAPER_SPEED, FAST))
        objects |= {
            f"approaching, {shade}": (Looming(contact=CONTACT, luminance=luminance), PICTURE_TIMES),
            f"receding, {shade}": (Receding(contact=0.4, luminance=luminance), (0.4, 0.6, 0.8, 1.1)),
            f"passing at 0.108 m/s, {shade}": (slow, (0.3, 0.9, 1.5, 2.1)),
            f"passing at 0.3 m/s, {shade}": (fast, (0.8, 1.15, 1.5, 1.85)),
        }
    responses: dict[str, StimulusResponse] = {}
    for name, (foreground, times) in objects.items():
        responses[name] = run_stimulus(background, foreground, models=models, picture_times=times)
        on_step()
    return responses


class Approach(NamedTuple):
    """Response to an approach."""

    l_over_v: float  # half size over speed [s]
    peak: float  # time from the peak of the spike frequency to contact [s]
    alarm: float  # time from the first alarm to contact [s]; NaN without alarm
    response: StimulusResponse  # responses of the models


def approaches(on_step: StepCallback) -> list[Approach]:
    """Return the responses to a dark square at ten values of l/|v|, as in Gabbiani et al. (1999)."""
    results: list[Approach] = []
    for l_over_v in L_OVER_V:
        contact = max(2.0, 8.0 * l_over_v)
        square = Looming(l_over_v=l_over_v, contact=contact, largest=85.0)
        response = run_stimulus(Plain(), square, contact)
        frequency = response.frequency["paper"]
        # The frequency is a mean over six frames, so its maximum spans several frames: take their middle.
        peak = response.time[frequency == frequency.max()].mean()
        alarms = response.times_above(30.0)
        alarm = contact - float(alarms[0]) if len(alarms) else math.nan
        results.append(Approach(l_over_v, contact - float(peak), alarm, response))
        on_step()
    return results


def selectivity(on_step: StepCallback) -> dict[str, dict[str, int]]:
    """Return the number of spikes of each model by kind of motion, on a plain background."""
    half = 0.04
    objects = {
        "approach": Looming(contact=CONTACT),
        "recede": Receding(contact=0.0),
        "pass at 0.108 m/s": Translating(half_size=half, centred=1.5),
        "pass at 0.3 m/s": Translating(half_size=half, speed=0.3, centred=1.5),
    }
    counts: dict[str, dict[str, int]] = {model: {} for model in MODELS}
    for name, foreground in objects.items():
        response = run_stimulus(Plain(), foreground)
        for model, spikes in response.spikes.items():
            counts[model][name] = int(spikes.sum())
        on_step()
    return counts


def line_fit(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Return slope, intercept and the half-width of the slope's 95 % interval of a least-squares line."""
    slope, intercept = np.polyfit(x, y, 1)
    residuals = y - (slope * x + intercept)
    variance = float((residuals**2).sum()) / max(len(x) - 2, 1)
    error = math.sqrt(variance / float(((x - x.mean()) ** 2).sum()))
    return float(slope), float(intercept), 2.31 * error  # Student's t, 8 degrees of freedom


@dataclass(frozen=True)
class ExperimentResults:
    """Results of all experiments on synthetic stimuli."""

    gratings: list[GratingResponse]
    low_contrast: list[GratingResponse]
    looming: list[LoomingInGrating]
    light_dark: list[LuminanceLeads]
    panorama: dict[str, StimulusResponse]
    approaches: list[Approach]
    selectivity: dict[str, dict[str, int]]


STEPS = 30 + 30 + 18 + 6 + 9 + len(L_OVER_V) + 4  # calls of `on_step` in `run_experiments`


def run_experiments(on_step: StepCallback, picture: Path | None = None) -> ExperimentResults:
    """Run all experiments on synthetic stimuli.

    Args:
        on_step: Function called `STEPS` times, for a progress bar.
        picture: Image file for the panorama; None for a random image.
    """
    return ExperimentResults(
        gratings(on_step),
        low_contrast_gratings(on_step),
        looming_in_gratings(on_step),
        light_and_dark(on_step),
        panorama(on_step, picture),
        approaches(on_step),
        selectivity(on_step),
    )

"""The paper's experiments on synthetic stimuli, each a function that returns what was seen and answered."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lgmd_gym.neuron import LGMD, LGMDParams
from lgmd_gym.paper.stimuli import (
    SIZES,
    Background,
    Frame,
    Grating,
    Looming,
    Object,
    Panorama,
    Plain,
    Receding,
    Screen,
    Translating,
    frames,
)

FPS = 30.0
DARK, LIGHT, GREY = 20.0, 235.0, 127.5
# The paper's neuron, it without what it adds, and what came before.
MODELS = {
    "paper": LGMDParams(),
    "fixed inhibition": LGMDParams.fixed_inhibition(),
    "Yue & Rind 2006": LGMDParams.yue_rind2006(),
}
SPATIAL = (1000 / 190, 10.0, 20.0, 40.0, 60.0, 80.0)  # [periods/m]: periods of 190 to 12.5 px
TEMPORAL = (0.5, 1.0, 2.0, 7.0, 14.0)  # [Hz]
CONTRASTS = (0.05, 0.1, 0.2, 0.3, 0.5, 1.0)
L_OVER_V = (0.01, 0.02, 0.03, 0.04, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3)  # [s]
Params = Mapping[str, LGMDParams]
Tick = Callable[[], object]


@dataclass(frozen=True)
class Trial:
    """One stimulus and what each model answered.

    Attributes:
        name: Of the stimulus.
        time: Of each frame [s], shape (frames,).
        frequency: Model to spike frequency [spikes/s], shape (frames,).
        potential: Model to membrane potential K.
        spikes: Model to spikes of each frame.
        ffi: Of the first model [grey levels].
        pictures: Some (time [s], frame).
    """

    name: str
    time: np.ndarray
    frequency: dict[str, np.ndarray]
    potential: dict[str, np.ndarray]
    spikes: dict[str, np.ndarray]
    ffi: np.ndarray
    pictures: list[tuple[float, Frame]]

    def above(self, level: float, model: str = "paper") -> np.ndarray:
        """Return the times at which the frequency is at or above a level [s]."""
        return self.time[self.frequency[model] >= level]

    def peak(self, model: str = "paper") -> float:
        """Return the highest frequency [spikes/s]."""
        return float(self.frequency[model].max())


def trial(
    name: str,
    screen: Screen,
    seconds: float,
    background: Background,
    thing: Object | None = None,
    models: Params = MODELS,
    shown: tuple[float, ...] = (),
) -> Trial:
    """Show a stimulus to several models at once.

    Args:
        name: Of the stimulus.
        screen: Size, rate and scale.
        seconds: How long.
        background: What lies behind.
        thing: What moves in front; None for nothing.
        models: Name to parameters.
        shown: Times whose frames are kept [s].
    """
    neurons = {model: LGMD(screen.shape, screen.fps, params) for model, params in models.items()}
    answers: dict[str, list] = {model: [] for model in models}
    wanted = {round(time * screen.fps) for time in shown}
    pictures = []
    for number, frame in enumerate(frames(screen, seconds, background, thing)):
        if number in wanted:
            pictures.append((number / screen.fps, frame))
        for model, neuron in neurons.items():
            answers[model].append(neuron.step(frame))

    def series(field: str) -> dict[str, np.ndarray]:
        return {model: np.array([getattr(r, field) for r in rows]) for model, rows in answers.items()}

    first = next(iter(models))
    time = np.arange(len(answers[first])) / screen.fps
    frequency, potential = series("spike_frequency"), series("membrane_potential")
    return Trial(name, time, frequency, potential, series("spikes"), series("ffi")[first], pictures)


class GratingAnswer(NamedTuple):
    """The highest K of each model on one grating, and the mean F."""

    grating: Grating
    potential: dict[str, float]
    ffi: float


def gratings(tick: Tick) -> list[GratingAnswer]:
    """Thirty drifting gratings of full contrast: six periods by five temporal frequencies."""
    return [
        _grating(Grating(spatial=spatial, temporal=temporal), tick)
        for spatial in SPATIAL
        for temporal in TEMPORAL
    ]


def faint_gratings(tick: Tick) -> list[GratingAnswer]:
    """The same at 40 periods/m and falling contrast: where the inhibition no longer grows."""
    return [
        _grating(Grating(spatial=40.0, temporal=temporal, contrast=contrast), tick)
        for contrast in CONTRASTS
        for temporal in TEMPORAL
    ]


def _grating(grating: Grating, tick: Tick) -> GratingAnswer:
    models = {
        **MODELS,
        "neither adaptation nor silencing": LGMDParams(t_f=math.inf),
        "no warm start": LGMDParams(warm_start=False),
    }
    screen = Screen(shape=SIZES["gratings"], fps=FPS)
    seen = trial("grating", screen, 1.2, grating, models=models)
    tick()
    potential = {model: float(values.max()) for model, values in seen.potential.items()}
    return GratingAnswer(grating, potential, float(seen.ffi[1:].mean()))


CONTACT = 3.0  # when the looming object would touch [s]
SHOWN = (1.0, 2.3, 2.6, 2.8, 2.93)


def looming_in_gratings(tick: Tick) -> list[tuple[float, float, float, Trial]]:
    """Return (contrast, periods/m, luminance, trial) of squares that loom in gratings of 2 Hz."""
    found = []
    for contrast in (0.2, 0.5, 1.0):
        for spatial in (40.0, 60.0, 80.0):
            for luminance in (DARK, LIGHT):
                behind = Grating(spatial=spatial, temporal=2.0, contrast=contrast)
                thing = Looming(contact=CONTACT, luminance=luminance)
                seen = trial(f"{spatial:g}/m", Screen(fps=FPS), CONTACT, behind, thing, shown=SHOWN)
                found.append((contrast, spatial, luminance, seen))
                tick()
    return found


def light_and_dark(tick: Tick) -> list[tuple[float, float, float]]:
    """Return (background, first time at 30 spikes/s before contact of a dark, of a light square) [s]."""
    found = []
    for ground in (60.0, GREY, 195.0):
        leads = []
        for luminance in (DARK, LIGHT):
            thing = Looming(contact=CONTACT, luminance=luminance, l_over_v=0.2)
            seen = trial("plain", Screen(fps=60.0), CONTACT, Plain(luminance=ground), thing)
            begins = seen.above(30.0)
            leads.append(CONTACT - float(begins[0]) if len(begins) else math.nan)
            tick()
        found.append((ground, *leads))
    return found


def panorama(tick: Tick, picture: Path | None = None) -> dict[str, Trial]:
    """An object that approaches, recedes, or passes by, in a panorama that shifts."""
    behind = Panorama(picture=picture)
    variants = {**MODELS, "T_sp = 0.78": LGMDParams(t_sp=0.78), "sigma_3 = 2": LGMDParams(sigma_3=2.0)}
    things: dict[str, tuple[Object | None, tuple[float, ...]]] = {
        "panorama alone": (None, (1.5,)),
        "approaching, dark": (Looming(contact=CONTACT), SHOWN),
        "approaching, light": (Looming(contact=CONTACT, luminance=LIGHT), SHOWN),
        "receding": (Receding(contact=0.4), (0.4, 0.6, 0.8, 1.1, 2.0)),
        "passing at 0.108 m/s": (Translating(centred=1.5), (0.3, 0.9, 1.5, 2.1, 2.7)),
        "passing at 0.3 m/s": (Translating(speed=0.3, centred=1.5), (0.8, 1.15, 1.5, 1.85, 2.2)),
    }
    found = {}
    for name, (thing, shown) in things.items():
        found[name] = trial(name, Screen(fps=FPS), CONTACT, behind, thing, variants, shown)
        tick()
    return found


class Approach(NamedTuple):
    """One approach at some l/|v|: how long before contact the frequency peaked and first alarmed [s]."""

    l_over_v: float
    peak: float
    alarm: float
    trial: Trial


def approaches(tick: Tick) -> list[Approach]:
    """A dark square on grey at ten values of l/|v|, without a largest size, as in Gabbiani et al. (1999)."""
    found = []
    for l_over_v in L_OVER_V:
        contact = max(2.0, 8.0 * l_over_v)
        thing = Looming(l_over_v=l_over_v, contact=contact, largest=85.0)
        seen = trial(f"l/|v| {1000 * l_over_v:g} ms", Screen(fps=FPS), contact, Plain(), thing)
        frequency = seen.frequency["paper"]
        # The middle of a flat top: the frequency is a mean over six frames.
        top = seen.time[frequency == frequency.max()].mean()
        begins = seen.above(30.0)
        alarm = contact - float(begins[0]) if len(begins) else math.nan
        found.append(Approach(l_over_v, contact - float(top), alarm, seen))
        tick()
    return found


def selectivity(tick: Tick) -> dict[str, dict[str, int]]:
    """Return model to spikes in an approach, the same backwards, and passing by, on plain grey."""
    half = 0.04
    things = {
        "approach": Looming(contact=CONTACT),
        "recede": Receding(contact=0.0),
        "pass at 0.108 m/s": Translating(half_size=half, centred=1.5),
        "pass at 0.3 m/s": Translating(half_size=half, speed=0.3, centred=1.5),
    }
    counts: dict[str, dict[str, int]] = {model: {} for model in MODELS}
    for name, thing in things.items():
        seen = trial(name, Screen(fps=FPS), CONTACT, Plain(), thing)
        for model, spikes in seen.spikes.items():
            counts[model][name] = int(spikes.sum())
        tick()
    return counts


def line_fit(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Return slope, intercept and the slope's 95 % half-width of a least-squares line."""
    slope, intercept = np.polyfit(x, y, 1)
    rest = y - (slope * x + intercept)
    spread = math.sqrt(float((rest**2).sum()) / max(len(x) - 2, 1) / float(((x - x.mean()) ** 2).sum()))
    return float(slope), float(intercept), 2.31 * spread  # Student's t, 8 degrees of freedom


@dataclass(frozen=True)
class Findings:
    """Everything that the experiments on synthetic stimuli gave."""

    gratings: list[GratingAnswer]
    faint: list[GratingAnswer]
    looming: list[tuple[float, float, float, Trial]]
    light_dark: list[tuple[float, float, float]]
    panorama: dict[str, Trial]
    approaches: list[Approach]
    selectivity: dict[str, dict[str, int]]


STEPS = 30 + 30 + 18 + 6 + 6 + len(L_OVER_V) + 4  # ticks of `experiments`


def experiments(tick: Tick, picture: Path | None = None) -> Findings:
    """Run every experiment on synthetic stimuli; `tick` is called `STEPS` times."""
    return Findings(
        gratings(tick), faint_gratings(tick), looming_in_gratings(tick), light_and_dark(tick),
        panorama(tick, picture), approaches(tick), selectivity(tick),
    )  # fmt: skip

"""Effect of the deviations of the default neuron from the printed equations, on the stimuli of the paper.

    python docs/experiments/deviations.py

Each row but the first has one field of `LGMDParams` as printed; the last one has all of them. The table is in
Markdown.
"""

from itertools import product
from typing import NamedTuple

import numpy as np

from lgmd_gym import LGMDParams
from lgmd_gym.paper.backgrounds import SHAPES, Grating, Panorama, Screen
from lgmd_gym.paper.experiments import CONTACT, FPS, SPATIAL, TEMPORAL, run_stimulus
from lgmd_gym.paper.stimuli import Background, ForegroundObject, Looming, Receding, Translating

MODELS = {
    "default": LGMDParams(),
    "spikes from K (eq. 11)": LGMDParams(spikes_from="membrane"),
    "seven terms (eq. 12)": LGMDParams(extra_frame=True),
    "filters start at 0": LGMDParams(warm_start=False),
    "`literal`": LGMDParams.literal(),
}
OBJECTS: dict[str, ForegroundObject | None] = {
    "approach": Looming(contact=CONTACT),
    "recede": Receding(contact=0.4),
    "pass": Translating(speed=0.3, centred=1.5),
    "nothing": None,
}


class Effect(NamedTuple):
    """Results of one model.

    Attributes:
        silent_gratings: Number of 30 gratings of full contrast without a spike.
        lead: Time from the first alarm (30 spikes/s) of an approach in a shifting panorama to contact [s].
        peak: Highest spike frequency of the approach [spikes/s].
        frames: Frames of 90 at 30 spikes/s or more while an object recedes, passes at 0.3 m/s, and without
            an object.
    """

    silent_gratings: int
    lead: float
    peak: float
    frames: tuple[int, int, int]


def main() -> dict[str, Effect]:
    """Run the stimuli, print the table and return the results by model."""
    screen = Screen(shape=SHAPES["gratings"], fps=FPS)
    silent = dict.fromkeys(MODELS, 0)
    for spatial, temporal in product(SPATIAL, TEMPORAL):
        for model, spikes in _spikes(Grating(spatial=spatial, temporal=temporal), screen).items():
            silent[model] += not spikes.any()
    responses = {
        name: run_stimulus(Panorama(), foreground, models=MODELS) for name, foreground in OBJECTS.items()
    }
    effects = {}
    for model in MODELS:
        times = {name: response.times_above(30.0, model) for name, response in responses.items()}
        lead = CONTACT - float(times["approach"][0])
        frames = len(times["recede"]), len(times["pass"]), len(times["nothing"])
        effects[model] = Effect(silent[model], lead, responses["approach"].peak(model), frames)
    print("| model | gratings without a spike | alarm before contact | peak | recede, pass, no object |")
    print("|---|---|---|---|---|")
    for model, effect in effects.items():
        counts = ", ".join(map(str, effect.frames))
        print(
            f"| {model} | {effect.silent_gratings}/30 | {effect.lead:.2f} s | {effect.peak:.0f} | {counts} |"
        )
    return effects


def _spikes(background: Background, screen: Screen) -> dict[str, np.ndarray]:
    return run_stimulus(background, seconds=1.2, screen=screen, models=MODELS).spikes


if __name__ == "__main__":
    main()

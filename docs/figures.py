"""Generate the figures of the page on the neuron."""

import math
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import lgmd_gym  # noqa: F401  (registers the environments)
from lgmd_gym import LGMD, LGMDParams
from lgmd_gym.paper.backgrounds import Grating, Screen
from lgmd_gym.paper.stimuli import Looming, Receding, Translating, stimulus_frames
from lgmd_gym.plotting.figures import layers_figure
from lgmd_gym.plotting.style import COLOURS, saved_figure

SCREEN = Screen()
SECONDS = 4.0
STIMULI: dict[str, dict[str, Any]] = {
    "approaches": {"foreground": Looming()},
    "recedes": {"foreground": Receding()},
    "passes": {"foreground": Translating()},
    "a grating drifts": {"background": Grating()},
}


def main(folder: Path) -> None:
    """Draw all figures into a folder."""
    diagram(folder / "neuron.png")
    layers(folder / "layers.png")
    responses(folder / "responses.png")
    adaptation(folder / "adaptation.png")


def layers(path: Path) -> None:
    """Draw the layers of a neuron shortly before contact."""
    env = gym.make("LGMD/CCRs-v0", ego_speed=11.1, shade=60, include_frame=True)
    neuron = LGMD((90, 160))
    observation, info = env.reset(seed=0)
    while not info["ttc"] < 1.2:
        neuron.step(observation["frame"][:, :, 0])
        observation, *_, info = env.step([0.0])
    frame = observation["frame"][:, :, 0]
    neuron.step(frame)
    layers_figure(path, neuron, frame)


def responses(path: Path) -> None:
    """Draw the potential and the spike frequency for four stimuli."""
    with saved_figure(path, 2, 4, figsize=(10.0, 4.2), sharex=True, sharey="row") as (_, axes):
        for column, (name, stimulus) in zip(axes.T, STIMULI.items(), strict=True):
            neuron = LGMD(SCREEN.shape, fps=SCREEN.fps)
            steps = [neuron.step(frame) for frame in stimulus_frames(SCREEN, SECONDS, **stimulus)]
            time = np.arange(len(steps)) / SCREEN.fps
            column[0].plot(time, [step.membrane_potential for step in steps], color=COLOURS[2])
            column[1].plot(time, [step.spike_frequency for step in steps], color=COLOURS[1])
            column[1].axhline(neuron.params.t_sf, color="0.5", linestyle="--", linewidth=1.0)
            column[0].set_title(name)
            column[1].set_xlabel("time [s]")
        axes[0, 0].set_ylabel("potential K")
        axes[1, 0].set_ylabel("spike frequency\n[spikes/s]")


def adaptation(path: Path) -> None:
    """Draw the response to a grating with adaptive and with fixed inhibition."""
    models = {"w adapts (the paper)": LGMDParams(), "w fixed at σ1": LGMDParams(t_f=math.inf)}
    with saved_figure(path, 1, 2, figsize=(8.0, 2.8)) as (_, axes):
        for index, (name, params) in enumerate(models.items()):
            neuron = LGMD(SCREEN.shape, fps=SCREEN.fps, params=params)
            steps = [neuron.step(frame) for frame in stimulus_frames(SCREEN, 2.0, Grating())]
            time = np.arange(len(steps)) / SCREEN.fps
            line = {"color": COLOURS[2 - index], "label": name, "linestyle": ("-", "--")[index]}
            axes[0].plot(time, [step.inhibition_weight for step in steps], **line)
            axes[1].plot(time, [step.membrane_potential for step in steps], **line)
        axes[0].set_ylabel("inhibition weight w")
        axes[1].set_ylabel("potential K")
        for axis in axes:
            axis.set_xlabel("time [s]")
        axes[0].legend()


BOXES = {
    "L": (0.0, 1.0, "frame\nL(t)"),
    "P": (1.5, 1.0, "P\nchange"),
    "ON": (3.0, 1.6, "ON\nE, I"),
    "OFF": (3.0, 0.4, "OFF\nE, I"),
    "S": (4.5, 1.0, "S\nE − w·I"),
    "G": (6.0, 1.0, "G\nclusters"),
    "K": (7.5, 1.0, "K\nsigmoid"),
    "SFA": (9.0, 1.0, "K̂\nadapts"),
    "spikes": (11.0, 1.0, "spikes/s\n≥ T_sf: alert"),
    "F": (3.0, -0.8, "F̂ = mean |P|\nsets w, τ_g"),
}
ARROWS = (("L", "P"), ("P", "ON"), ("P", "OFF"), ("ON", "S"), ("OFF", "S"), ("S", "G"), ("G", "K"),
          ("K", "SFA"), ("SFA", "spikes"), ("P", "F"), ("F", "S"), ("F", "G"))  # fmt: skip


def diagram(path: Path) -> None:
    """Draw the block diagram of the neuron."""
    with saved_figure(path, 1, 1, figsize=(10.0, 3.2), grid=False) as (_, axis):
        axis.set(xlim=(-0.7, 12.0), ylim=(-1.4, 2.2))
        axis.axis("off")
        for x, y, label in BOXES.values():
            shape = {"boxstyle": "round,pad=0.35", "facecolor": "#eef4f9", "edgecolor": COLOURS[2]}
            axis.text(x, y, label, ha="center", va="center", fontsize=9, bbox=shape, zorder=3)
        for start, end in ARROWS:
            control = start == "F"  # sets a parameter of its target
            arrow = {
                "arrowstyle": "-|>",
                "color": COLOURS[1] if control else "0.35",
                "linestyle": "--" if control else "-",
                "shrinkA": 24,
                "shrinkB": 34 if end == "spikes" else 24,
            }
            axis.annotate("", BOXES[end][:2], BOXES[start][:2], arrowprops=arrow)


if __name__ == "__main__":
    main(Path("."))

"""The figures of the page on the neuron, made by the neuron."""

import math
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import lgmd_gym  # noqa: F401  (registers the environments)
from lgmd_gym import LGMD, LGMDParams
from lgmd_gym.paper.stimuli import Grating, Looming, Receding, Screen, Translating, frames
from lgmd_gym.plotting import figures, style

SCREEN = Screen()
SECONDS = 4.0
STIMULI: dict[str, dict[str, Any]] = {
    "approaches": {"thing": Looming()},
    "recedes": {"thing": Receding()},
    "passes": {"thing": Translating()},
    "a grating drifts": {"background": Grating()},
}


def main(folder: Path) -> None:
    """Draw all figures into a folder."""
    diagram(folder / "neuron.png")
    layers(folder / "layers.png")
    answers(folder / "answers.png")
    adaptation(folder / "adaptation.png")


def layers(path: Path) -> None:
    """Draw the maps of a neuron shortly before contact."""
    env = gym.make("LGMD/CCRs-v0", ego_speed=11.1, shade=60, include_frame=True)
    neuron = LGMD((90, 160))
    observation, info = env.reset(seed=0)
    while not info["ttc"] < 1.2:
        neuron.step(observation["frame"][:, :, 0])
        observation, *_, info = env.step([0.0])
    frame = observation["frame"][:, :, 0]
    neuron.step(frame)
    figures.layers_figure(path, neuron, frame)


def answers(path: Path) -> None:
    """Draw what the neuron says to four stimuli."""
    plt = style.load_pyplot()
    with plt.rc_context(style.STYLE):
        figure, axes = plt.subplots(
            2, 4, figsize=(10.0, 4.2), sharex=True, sharey="row", layout="constrained"
        )
        for column, (name, scene) in zip(axes.T, STIMULI.items(), strict=True):
            neuron = LGMD(SCREEN.shape, fps=SCREEN.fps)
            said = [neuron.step(frame) for frame in frames(SCREEN, SECONDS, **scene)]
            time = np.arange(len(said)) / SCREEN.fps
            column[0].plot(time, [answer.membrane_potential for answer in said], color=style.COLOURS[2])
            column[1].plot(time, [answer.spike_frequency for answer in said], color=style.COLOURS[1])
            column[1].axhline(neuron.params.t_sf, color="0.5", linestyle="--", linewidth=1.0)
            column[0].set_title(name)
            column[1].set_xlabel("time [s]")
        axes[0, 0].set_ylabel("potential K")
        axes[1, 0].set_ylabel("spike frequency\n[spikes/s]")
        figure.savefig(path)
        plt.close(figure)


def adaptation(path: Path) -> None:
    """Draw what the adaptive inhibition does to a fast grating, with and without it."""
    plt = style.load_pyplot()
    scene = {"background": Grating()}
    models = {"w adapts (the paper)": LGMDParams(), "w fixed at σ1": LGMDParams(t_f=math.inf)}
    with plt.rc_context(style.STYLE):
        figure, axes = plt.subplots(1, 2, figsize=(8.0, 2.8), layout="constrained")
        for index, (name, params) in enumerate(models.items()):
            neuron = LGMD(SCREEN.shape, fps=SCREEN.fps, params=params)
            said = [neuron.step(frame) for frame in frames(SCREEN, 2.0, **scene)]
            time = np.arange(len(said)) / SCREEN.fps
            look = {"color": style.COLOURS[2 - index], "label": name, "linestyle": ("-", "--")[index]}
            axes[0].plot(time, [answer.inhibition_weight for answer in said], **look)
            axes[1].plot(time, [answer.membrane_potential for answer in said], **look)
        axes[0].set_ylabel("inhibition weight w")
        axes[1].set_ylabel("potential K")
        for axis in axes:
            axis.set_xlabel("time [s]")
        axes[0].legend()
        figure.savefig(path)
        plt.close(figure)


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
    """Draw what feeds what."""
    plt = style.load_pyplot()
    figure, axis = plt.subplots(figsize=(10.0, 3.2), layout="constrained")
    axis.set(xlim=(-0.7, 12.0), ylim=(-1.4, 2.2))
    axis.axis("off")
    for x, y, words in BOXES.values():
        shape = {"boxstyle": "round,pad=0.35", "facecolor": "#eef4f9", "edgecolor": style.COLOURS[2]}
        axis.text(x, y, words, ha="center", va="center", fontsize=9, bbox=shape, zorder=3)
    for start, end in ARROWS:
        dashed = start == "F"
        look = {"arrowstyle": "-|>", "color": style.COLOURS[1] if dashed else "0.35"}
        look |= {
            "linestyle": "--" if dashed else "-",
            "shrinkA": 24,
            "shrinkB": 34 if end == "spikes" else 24,
        }
        axis.annotate("", BOXES[end][:2], BOXES[start][:2], arrowprops=look)
    figure.savefig(path)
    plt.close(figure)


if __name__ == "__main__":
    main(Path("."))

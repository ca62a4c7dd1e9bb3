"""Generate the figures of the page on the neuron."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import lgmd_gym  # noqa: F401  (registers the environments)
from lgmd_gym import LGMD, LGMDParams
from lgmd_gym.paper.backgrounds import Grating, Screen
from lgmd_gym.paper.stimuli import Looming, Receding, Translating, stimulus_frames, stimulus_set
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
    edges(folder / "edges.png")
    stimuli(folder / "stimuli.png")


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


def edge_frames(speed: float, acceleration: float, count: int) -> Iterator[np.ndarray]:
    """Yield frames of 40 × 400 px with a dark edge that moves to the right [px/frame, px/frame²]."""
    for number in range(count):
        position = 20.0 + speed * number + 0.5 * acceleration * number**2
        covered = np.clip(position - np.arange(400), 0.0, 1.0)
        yield np.tile(np.rint(127.5 - 107.5 * covered), (40, 1)).astype(np.uint8)


def share_left(speed: float, acceleration: float = 0.0) -> list[tuple[float, float]]:
    """Return the speed [px/frame] and S / E of the frames with an edge, from the seventh on."""
    neuron, shares = LGMD((40, 400)), list[tuple[float, float]]()
    for number, frame in enumerate(edge_frames(speed, acceleration, 80)):
        neuron.step(frame)
        excitation, moved = neuron.layers["E"].sum(), speed * number + 0.5 * acceleration * number**2
        if number > 6 and moved < 360.0:
            shares.append((speed + acceleration * number, float(neuron.layers["S"].sum() / excitation)))
    return shares


def edges(path: Path) -> None:
    """Draw what the inhibition leaves of edges over their speed, and K and K̂ for two constant speeds."""
    speeds = (0.25, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0)
    with saved_figure(path, 1, 2, figsize=(8.6, 3.0)) as (_, (left, right)):
        constant = [np.mean([share for _, share in share_left(speed)]) for speed in speeds]
        left.plot(speeds, constant, "o-", color=COLOURS[2], label="constant speed")
        for acceleration, colour in ((0.1, COLOURS[1]), (0.5, COLOURS[5])):
            left.plot(*np.transpose(share_left(0.5, acceleration)), ".", color=colour,
                      label=f"accelerating by {acceleration:g} px/frame²")  # fmt: skip
        left.set(xscale="log", ylim=(0.0, 1.0), xlabel="speed [px/frame]", ylabel="S / E")
        left.legend(fontsize=7)
        for speed, colour in ((4.0, COLOURS[2]), (3.6, COLOURS[1])):
            neuron = LGMD((40, 400))
            steps = [neuron.step(frame) for frame in edge_frames(speed, 0.0, 90)]
            time, spikes = np.arange(len(steps)) / 30.0, sum(step.spikes for step in steps)
            label = f"{speed:g} px/frame: {spikes} spikes"
            right.plot(time, [step.membrane_potential for step in steps], color=colour, label=label)
            right.plot(time, [step.adapted_potential for step in steps], "--", color=colour)
        right.axhline(LGMDParams().t_sp, color="0.5", linestyle=":", linewidth=1.0)
        right.set(ylim=(0.48, 1.02), xlabel="time [s]", ylabel="K (dashed: K̂, dotted: T_sp)")
        right.legend(fontsize=7)


SHOWN_STIMULI = (
    "looming-square-dark-100ms", "looming-disc-light-100ms", "receding-disc-dark-100ms",
    "translating-square-light-0.3mps", "elongating-square-dark-0.108mps", "elongating-bar-light-0.108mps",
    "grating-60-per-m-2hz", "looming-in-grating-40-per-m-contrast-0.2-light", "looming-in-panorama-dark",
    "translating-in-panorama-light-0.3mps",
)  # fmt: skip


def stimuli(path: Path) -> None:
    """Draw four frames of ten stimuli of the set, with the label and the angular size of each."""
    known = stimulus_set()
    with saved_figure(path, len(SHOWN_STIMULI) // 2, 8, figsize=(12.0, 6.0), grid=False) as (_, axes):
        for row, name in zip(axes.reshape(-1, 4), SHOWN_STIMULI, strict=True):
            frames, truth = list(known[name].frames(SCREEN)), known[name].truth(SCREEN)
            row[0].set_title(name, fontsize=7, loc="left")
            for axis, number in zip(row, (24, 42, 60, 81), strict=True):
                axis.imshow(frames[number], cmap="gray", vmin=0, vmax=255)
                axis.set(xticks=[], yticks=[])
                state = truth[number]
                size = f", {state.angular_size_deg:.0f}°" if state.label != "none" else ""
                axis.set_xlabel(f"{state.time_s:.1f} s: {state.label}{size}", fontsize=6)


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

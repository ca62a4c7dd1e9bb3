"""Fit parameters of the LGMD by gradient descent on recorded levels, and judge them on validation levels.

python docs/examples/fit_neuron.py --out fitted.toml

Random levels of the training worlds are recorded without braking, with their frames. Two kinds of frames are
cut from them: *useful* ones, in the last second in which braking still avoids the contact, and *quiet* ones,
of levels without a threat or long before the contact. The fit ranks useful above quiet frames by the mean of
the excitation G. The spike threshold t_sp then sets the share of quiet frames in alarm. The parameters go to
the compiled neuron, which plays whole levels of other worlds.
"""

import time
from argparse import ArgumentParser
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

from lgmd_gym.neuron import LGMD, LGMDParams
from lgmd_gym.neuron.lgmd_torch import LayerResponse, LGMDLayer, Softness
from lgmd_gym.training.offline.driving import DriveRecorder

CAMERA, FPS, ALARM = "fovea", 30.0, 30.0  # frames per second; spikes/s
LEARNED = ("theta_1", "theta_2", "sigma_1", "t_de", "t_f", "tau_2", "weights", "c_w")
FORWARD = ("CCRs", "CCRm", "CCRb", "CMRs", "CMRb", "CPLA", "CBLA")  # threats ahead, in view of one camera
USEFUL, QUIET = 30, 120  # frames: before the last timely braking; least distance of quiet frames to a contact
CLIP, SCORED = 24, 6  # frames of a training clip, and the last of them that count
BATCH, RATE = 4, 0.03  # clips of each kind per step, and the learning rate
SETTLING = 8  # first frames of a level that are not used
FALSE = 0.1  # share of quiet training frames in alarm after the calibration
CHUNK = 20  # levels recorded at a time


class Level(NamedTuple):
    """Frames of one level without braking."""

    frames: np.ndarray  # uint8, (T, H, W)
    useful: np.ndarray  # indices of the useful frames
    quiet: np.ndarray  # indices of the quiet frames


def record(split: str, levels: range) -> Iterator[Level]:
    """Yield levels of a split; threats that are not ahead are left out."""
    arguments = {"split": split, "camera": CAMERA, "include_frame": True}
    recorder = DriveRecorder("LGMD/RandomBraking-v0", arguments, shrink=1, brakes=False)
    for start in range(levels.start, levels.stop, CHUNK):
        for (episode,) in recorder.record(range(start, min(start + CHUNK, levels.stop))):
            threat = episode.time_to_brake[-1] == 0.0  # the level ends in a contact
            if threat and episode.family not in FORWARD:
                continue
            indices = np.arange(SETTLING, len(episode))
            useful, quiet = indices[:0], indices
            if threat:
                timely = np.flatnonzero(episode.time_to_brake > 0.0)
                last = timely[-1] if len(timely) else -1
                useful = indices[(indices >= last - USEFUL) & (indices <= last)]
                quiet = indices[indices < len(episode) - QUIET]
            yield Level(episode.observations["frame"][..., 0], useful, quiet)


def excitation(response: LayerResponse, scale: torch.Tensor) -> torch.Tensor:
    """Return the mean logarithm of the mean of G over the scored frames, (N,); `scale` is sigma_3."""
    potential = response.membrane_potential[:, -SCORED:].double().clamp(max=1.0 - 1e-9)
    return torch.log(torch.logit(potential) * scale + 0.05).mean(1)


def fit(levels: Sequence[Level], steps: int, seed: int = 0) -> LGMDParams:
    """Return the parameters after some steps of gradient descent; prints the loss four times."""
    layer = LGMDLayer(FPS, learn=LEARNED, softness=Softness(surrogate=True))
    optimizer = torch.optim.Adam(layer.parameters(), lr=RATE, betas=(0.9, 0.99))
    rng, losses = np.random.default_rng(seed), []
    draw_useful, draw_quiet = (clips_of(levels, kind, rng) for kind in ("useful", "quiet"))
    for step in range(1, steps + 1):
        clips = np.stack([*(draw_useful() for _ in range(BATCH)), *(draw_quiet() for _ in range(BATCH))])
        response, _ = layer(torch.from_numpy(clips))
        score = excitation(response, layer.values()["sigma_3"])
        difference = score[:BATCH, None] - score[None, BATCH:]
        loss = torch.nn.functional.softplus(-difference).mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        layer.clamp_()
        losses.append(loss.item())
        if step % max(steps // 4, 1) == 0:
            print(f"step {step}: loss {np.mean(losses[-steps // 4 :]):.3f}")
    return layer.to_params()


def clips_of(levels: Sequence[Level], kind: str, rng: np.random.Generator) -> Callable[[], np.ndarray]:
    """Return a function that draws a clip, (CLIP, H, W), which ends at a random frame of a kind."""
    ends = [(level, getattr(level, kind)) for level in levels]
    ends = [(level, indices[indices >= CLIP]) for level, indices in ends]
    ends = [(level, indices) for level, indices in ends if len(indices)]

    def draw() -> np.ndarray:
        level, indices = ends[rng.integers(len(ends))]
        last = rng.choice(indices)
        return level.frames[last - CLIP + 1 : last + 1]

    return draw


def count(level: Level, params: LGMDParams) -> list[int]:
    """Return the numbers of useful and of quiet frames of a level in alarm, and of all such frames.

    The compiled neuron plays the whole level.
    """
    neuron = LGMD(level.frames.shape[1:], FPS, params)
    alarm = np.array([neuron.step(frame).spike_frequency >= ALARM for frame in level.frames])
    return [alarm[level.useful].sum(), alarm[level.quiet].sum(), len(level.useful), len(level.quiet)]


def calibrate(levels: Sequence[Level], params: LGMDParams, rounds: int = 7) -> LGMDParams:
    """Return the parameters with the t_sp at which a share `FALSE` of the quiet frames is in alarm."""
    low, high = 0.5, 1.0
    for _ in range(rounds):
        middle = (low + high) / 2
        counts = [count(level, replace(params, t_sp=middle)) for level in levels]
        _, false, _, quiet = np.sum(counts, axis=0)
        low, high = (middle, high) if false > FALSE * quiet else (low, middle)
    return replace(params, t_sp=round(high, 4))


def separation(counts: np.ndarray) -> np.ndarray:
    """Return the share of useful frames in alarm minus that of quiet frames; counts are (..., 4)."""
    frames = np.maximum(counts[..., 2:], 1.0)
    return counts[..., 0] / frames[..., 0] - counts[..., 1] / frames[..., 1]


def paired(first: np.ndarray, second: np.ndarray) -> tuple[float, float, float]:
    """Return the difference of the separations with its 95 % interval, of a bootstrap over levels."""
    picked = np.random.default_rng(0).integers(len(first), size=(5000, len(first)))
    gain = separation(second[picked].sum(1)) - separation(first[picked].sum(1))
    low, high = np.percentile(gain, (2.5, 97.5))
    return float(separation(second.sum(0)) - separation(first.sum(0))), float(low), float(high)


def main(arguments: Sequence[str] | None = None) -> dict[str, np.ndarray]:
    """Fit, calibrate, write and judge parameters; return the counts of each level, (levels, 4), by name."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--levels", type=int, default=120, help="training levels")
    parser.add_argument("--steps", type=int, default=160, help="steps of gradient descent")
    parser.add_argument("--validation", type=int, default=400, help="validation levels")
    parser.add_argument("--first", type=int, default=200, help="first validation level")
    parser.add_argument("--seed", type=int, default=0, help="seed of the drawn clips")
    parser.add_argument("--out", type=Path, default=Path("fitted.toml"), help="file of the parameters")
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    start = time.perf_counter()
    levels = list(record("train", range(options.levels)))
    print(f"recorded {len(levels)} levels in {time.perf_counter() - start:.0f} s")
    start = time.perf_counter()
    fitted = fit(levels, options.steps, options.seed)
    print(f"fitted in {time.perf_counter() - start:.0f} s")
    named = {"paper": calibrate(levels, LGMDParams()), "fitted": calibrate(levels, fitted)}
    for name in (*LEARNED, "t_sp"):
        print(f"  {name}: {getattr(named['paper'], name)} -> {getattr(named['fitted'], name)}")
    named["fitted"].to_toml(options.out)

    rows: dict[str, list[list[int]]] = {name: [] for name in named}
    for level in record("validation", range(options.first, options.first + options.validation)):
        for name, params in named.items():
            rows[name].append(count(level, params))
    results = {name: np.array(table, float) for name, table in rows.items()}
    for name, table in results.items():
        useful, quiet, n_useful, n_quiet = (int(number) for number in table.sum(0))
        print(f"{name}: alarm in {useful} of {n_useful} useful and {quiet} of {n_quiet} quiet frames")
    difference, low, high = paired(results["paper"], results["fitted"])
    print(f"difference of the two shares, fitted minus paper: {difference:+.3f} ({low:+.3f} to {high:+.3f})")
    return results


if __name__ == "__main__":
    main()

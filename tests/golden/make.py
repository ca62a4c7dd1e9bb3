"""Write the golden traces with the float64 reference: `python -m tests.golden.make` in the project root.

Only for an intended change of the model; the changelog must state why the traces differ.
"""

from pathlib import Path

import numpy as np

from lgmd_gym.neuron.lgmd.reference import ReferenceLGMD
from tests.golden.sequences import KINDS
from tests.support.neurons import PRESETS

SHAPE, COUNT, FPS = (45, 80), 40, 30.0


def trace(preset: str, kind: str) -> np.ndarray:
    """Return the outputs of the reference, one row of `Response` fields per frame; float64, (COUNT, 8)."""
    neuron = ReferenceLGMD(SHAPE, FPS, PRESETS[preset])
    return np.array([neuron.step(frame) for frame in KINDS[kind](SHAPE, COUNT)], float)


def main() -> None:
    """Write tests/golden/neuron.npz."""
    traces = {f"{preset}-{kind}": trace(preset, kind) for preset in PRESETS for kind in KINDS}
    path = Path(__file__).with_name("neuron.npz")
    np.savez_compressed(path, **traces)
    print(f"{len(traces)} traces in {path}")


if __name__ == "__main__":
    main()

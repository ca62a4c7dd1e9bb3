"""Write the golden traces from the float64 reference: `python -m tests.golden.make` in the project's root.

Only for a change of the model that is meant: say in the changelog why the traces differ.
"""

from pathlib import Path

import numpy as np

from lgmd_gym.neuron.params import LGMDParams
from lgmd_gym.neuron.reference import ReferenceLGMD
from tests.golden.sequences import KINDS

SHAPE, COUNT, FPS = (45, 80), 40, 30.0
PRESETS = ("default", "released", "fixed_inhibition", "off_only", "yue_rind2006")


def trace(preset: str, kind: str) -> np.ndarray:
    """The answers of the reference, one row a frame, the columns of `Response`; float64, (COUNT, 8)."""
    params = LGMDParams() if preset == "default" else getattr(LGMDParams, preset)()
    neuron = ReferenceLGMD(SHAPE, FPS, params)
    return np.array([neuron.step(frame) for frame in KINDS[kind](SHAPE, COUNT)], float)


def main() -> None:
    """Write tests/golden/neuron.npz."""
    traces = {f"{preset}-{kind}": trace(preset, kind) for preset in PRESETS for kind in KINDS}
    path = Path(__file__).with_name("neuron.npz")
    np.savez_compressed(path, **traces)
    print(f"{len(traces)} traces in {path}")


if __name__ == "__main__":
    main()

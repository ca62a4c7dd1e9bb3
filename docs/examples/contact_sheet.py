"""Contact sheet: camera frames of every highway-env road under every condition.

    python docs/examples/contact_sheet.py docs/contact_sheet.png

Camera and time are the same in each row; only the condition changes.
"""

import sys
from pathlib import Path

import numpy as np

from lgmd_gym.camera.params import CONDITIONS
from lgmd_gym.plotting.figures import contact_sheet
from lgmd_gym.report.gallery.stills import ROADS, road_sheet


def main(
    path: str | Path = "docs/contact_sheet.png", quick: bool = False
) -> dict[str, dict[str, np.ndarray]]:
    """Save the sheet and return its frames; `quick` limits it to two roads and two conditions."""
    roads = tuple(ROADS)[:2] if quick else tuple(ROADS)
    conditions = tuple(CONDITIONS)[:2] if quick else tuple(CONDITIONS)
    sheet = road_sheet(roads, conditions)
    contact_sheet(Path(path), sheet)
    print(f"{len(roads)} roads under {len(conditions)} conditions: {path}")
    return sheet


if __name__ == "__main__":
    main(*sys.argv[1:2])

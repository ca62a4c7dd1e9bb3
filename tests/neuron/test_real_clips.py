"""Real dash-camera clips: peak spike frequency and first alert frames, recorded with the final model.

The clips are not part of the project. Their folder is $LGMD_VIDEOS, by default ../shared/data/videos.
"""

import os
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

from lgmd_gym.neuron import LGMD

VIDEOS = Path(os.environ.get("LGMD_VIDEOS", Path(__file__).parents[3] / "shared" / "data" / "videos"))
FIRST_FRAME = 8  # earlier frames are ignored

# Peak [spikes/s], first frame >= 15, first frame >= 30 spikes/s.
TABLE = {
    "c01": (190, 60, 60),
    "c02": (225, 8, 8),
    "c06": (180, 41, 51),
    "c12": (85, 67, 67),
    "head-on-balloon": (190, 16, 24),
    "vehicle-following-crash": (235, 74, 74),
    "sudden-turning": (75, 63, 65),
    "nc03": (10, None, None),
    "nc07": (175, 8, 8),
}


def grey_frames(path):
    """Yield the frames as BT.601 luma, uint8."""
    frames = imageio_ffmpeg.read_frames(str(path), pix_fmt="rgb24")
    width, height = next(frames)["size"]
    for data in frames:
        rgb = np.frombuffer(data, np.uint8).reshape(height, width, 3)
        yield np.rint(rgb @ np.array([0.299, 0.587, 0.114])).astype(np.uint8)


@pytest.mark.parametrize("name", TABLE)
def test_real_clip(name):
    path = VIDEOS / f"{name}.mp4"
    if not path.exists():
        pytest.skip(f"clip {path.name} is missing; set LGMD_VIDEOS to the folder of the clips")
    neuron, rates = None, []
    for frame in grey_frames(path):
        neuron = neuron or LGMD(frame.shape, 30.0)
        rates.append(neuron.step(frame).spike_frequency)
    rates = np.array(rates)
    rates[:FIRST_FRAME] = 0
    first = [int(np.argmax(rates >= level)) if (rates >= level).any() else None for level in (15, 30)]
    assert (rates.max(), *first) == pytest.approx(TABLE[name])

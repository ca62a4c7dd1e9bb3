"""Video files: reading, writing and running the neuron on clips."""

from lgmd_gym.clips.reader import TruncatedVideoError, VideoReader, find_clips, luma
from lgmd_gym.clips.writer import VideoWriter

__all__ = ["TruncatedVideoError", "VideoReader", "VideoWriter", "find_clips", "luma"]

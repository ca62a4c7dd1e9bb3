"""Video files: reading, writing and running the neuron on clips."""

from lgmd_gym.video.reader import Reading, TruncatedVideoError, VideoReader, find_clips, luma
from lgmd_gym.video.writer import VideoWriter

__all__ = ["Reading", "TruncatedVideoError", "VideoReader", "VideoWriter", "find_clips", "luma"]

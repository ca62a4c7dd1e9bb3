"""Video files: reading, writing and running the neuron on clips."""

from lgmd_gym.clips.video import TruncatedVideoError, VideoReader, VideoWriter, find_clips, luma

__all__ = ["TruncatedVideoError", "VideoReader", "VideoWriter", "find_clips", "luma"]

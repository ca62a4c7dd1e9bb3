"""Presets and runs of the neuron that several test files share."""

from lgmd_gym.neuron import LGMD, LGMDParams

PRESETS = {
    "default": LGMDParams(),
    "literal": LGMDParams.literal(),
    "released": LGMDParams.released(),
    "fixed_inhibition": LGMDParams.fixed_inhibition(),
    "off_only": LGMDParams.off_only(),
}


def responses(frames, **options):
    """Return the responses of a new neuron to a sequence of frames, (count, H, W)."""
    neuron = LGMD(frames.shape[1:], **options)
    return [neuron.step(frame) for frame in frames]

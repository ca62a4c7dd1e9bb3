"""Channels from the arguments of environments."""

import pytest

from lgmd_gym.sensing.channel import make_channels


@pytest.mark.parametrize("field", ["neuron", "columns"])
def test_fields_of_a_channel_in_a_camera_are_explained(field):
    with pytest.raises(ValueError, match=r"fields of a channel, not of a camera.*use \{'camera'"):
        make_channels({"name": "fovea", field: "dsn"})

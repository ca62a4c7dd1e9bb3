# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Kernels that select the cameras to process, and collect the outputs of their neurons.

Their arrays arrive in one piece, see `Bundle`.
"""

from lgmd_gym.kernels import kernel
from lgmd_gym.neuron.scalars import ALERT, FREQUENCY, K_HAT, LATENCY, SPIKES, F, K, W

SIGNALS = ("spike_frequency", "membrane_potential", "ffi")
"""The fields of `Response` in observations and infos."""
NUMBERS = (*SIGNALS, "adapted_potential", "inhibition_weight", "excitation_latency")
"""The fields of `Response` that are floats."""
_COLUMNS = (FREQUENCY, K, F, K_HAT, W, LATENCY)  # of `NUMBERS` in the state of a neuron


@kernel(exact=True, arrays=True)
def select_cameras(first, last, active, group):
    """Select the enabled cameras of the active environments first..last-1.

    Args:
        first: First environment.
        last: Last environment + 1.
        active: Environments with a new frame, bool, shape (num_envs,).
        group: Arrays of the cameras with one frame shape (the members), `Bundle.native`: index of each
            member among all cameras, int64, shape (members,); the cameras in use, and those that have missed
            a frame (updated), bool, shape (num_envs, all cameras); the members to process, and those of them
            that had missed a frame (both written), bool, shape (num_envs, members).

    Returns:
        Number of members to process, and number of those that had missed a frame.
    """
    cameras, enabled, stale, selected, fresh = group.arrays
    num_selected, num_fresh = 0, 0
    for env in range(first, last):
        for member in range(cameras.shape[0]):
            camera = cameras[member]
            chosen = active[env] and enabled[env, camera]
            selected[env, member] = chosen
            fresh[env, member] = chosen and stale[env, camera]
            if active[env]:
                stale[env, camera] = not chosen
            num_selected += chosen
            num_fresh += fresh[env, member]
    return num_selected, num_fresh


@kernel(exact=True, arrays=True)
def count_turns(first, last, selected, lenses, yaws_px, turns_px):
    """Write the pixels by which derotated views have turned since their last frames, + to the right.

    Args:
        first: First environment.
        last: Last environment + 1.
        selected: Cameras with a new frame, bool, shape (num_envs, members).
        lenses: `CameraBatch.lenses`.
        yaws_px: Yaw of the last frame of each camera, float64, shape (num_envs, members), updated [px].
        turns_px: Turn of each camera, int64, shape (num_envs, members), written [px].

    Returns:
        Number of cameras that have turned.
    """
    count = 0
    for env in range(first, last):
        for member in range(selected.shape[1]):
            turns_px[env, member] = 0
            if selected[env, member]:
                yaw = lenses[env, member, 0].yaw_px
                turns_px[env, member] = int(yaw - yaws_px[env, member])
                yaws_px[env, member] = yaw
                count += turns_px[env, member] != 0
    return count


@kernel(exact=True, arrays=True)
def collect_outputs(first, last, selected, neurons):
    """Copy the outputs of the selected cameras' neurons into arrays of all cameras.

    Args:
        first: First environment.
        last: Last environment + 1.
        selected: Selected cameras, bool, shape (num_envs, members).
        neurons: Arrays of the members' neurons, `Bundle.native`: index of each member among all cameras,
            int64, shape (members,); `LGMD.outputs`, float64, (num_envs * members, at least 8); and written,
            for all cameras: `NUMBERS`, float64, shape (num_envs, 6, all cameras), the spikes, int64, and the
            alerts, bool, shape (num_envs, all cameras).
    """
    cameras, outputs, numbers, spikes, alerts = neurons.arrays
    members = cameras.shape[0]
    for env in range(first, last):
        for member in range(members):
            if not selected[env, member]:
                continue
            camera, row = cameras[member], env * members + member
            for field in range(len(_COLUMNS)):
                numbers[env, field, camera] = outputs[row, _COLUMNS[field]]
            spikes[env, camera] = int(outputs[row, SPIKES])
            alerts[env, camera] = outputs[row, ALERT] > 0.0

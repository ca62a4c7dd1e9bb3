"""Kernels that select the cameras to process, and collect the outputs of their neurons."""

from numba import njit


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def collect_outputs(first, last, selected, neurons):
    """Copy the outputs of the selected cameras' neurons into arrays of all cameras.

    Args:
        first: First environment.
        last: Last environment + 1.
        selected: Selected cameras, bool, shape (num_envs, members).
        neurons: Arrays of the members' neurons, `Bundle.native`: index of each member among all cameras,
            int64, shape (members,); `LGMD.outputs`, float64, (num_envs * members, at least 8); and written,
            for all cameras: the fields of `Response`, float64, shape (8, num_envs, all cameras), the spikes,
            int64, and the alerts, bool, shape (num_envs, all cameras).
    """
    cameras, outputs, numbers, spikes, alerts = neurons.arrays
    members = cameras.shape[0]
    for env in range(first, last):
        for member in range(members):
            if not selected[env, member]:
                continue
            camera, row = cameras[member], env * members + member
            for field in range(numbers.shape[0]):
                numbers[field, env, camera] = outputs[row, field]
            spikes[env, camera] = int(outputs[row, 1])
            alerts[env, camera] = outputs[row, 7] > 0.0

"""Kernels that select the cameras to process, and collect the outputs of their neurons."""

from numba import njit


@njit(cache=True, nogil=True)
def select_cameras(first, last, active, enabled, cameras, stale, fresh, selected):
    """Select the enabled cameras of the active environments first..last-1.

    Args:
        first: First environment.
        last: Last environment + 1.
        active: Environments with a new frame, bool, shape (num_envs,).
        enabled: Cameras in use, bool, shape (num_envs, all cameras).
        cameras: Indices of the cameras to select from (the members), int64, shape (members,).
        stale: Cameras that have missed a frame, bool, shape (num_envs, all cameras); updated.
        fresh: Written: cameras that were stale and are selected, bool, shape (num_envs, members).
        selected: Written: cameras to process, bool, shape (num_envs, members).

    Returns:
        Numbers of selected and of fresh cameras.
    """
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
def collect_outputs(first, last, selected, cameras, outputs, numbers, spikes, alerts):
    """Copy the outputs of the selected cameras' neurons into arrays of all cameras.

    Args:
        first: First environment.
        last: Last environment + 1.
        selected: Selected cameras, bool, shape (num_envs, members).
        cameras: Index of each member among all cameras, int64, shape (members,).
        outputs: `LGMD.outputs` of the members' neurons, float64, shape (num_envs * members, 8).
        numbers: Written: all fields of `Response`, float64, shape (8, num_envs, all cameras).
        spikes: Written: number of spikes, int64, shape (num_envs, all cameras).
        alerts: Written: alerts, bool, shape (num_envs, all cameras).
    """
    members = cameras.shape[0]
    for env in range(first, last):
        for member in range(members):
            if not selected[env, member]:
                continue
            camera, row = cameras[member], env * members + member
            for field in range(outputs.shape[1]):
                numbers[field, env, camera] = outputs[row, field]
            spikes[env, camera] = int(outputs[row, 1])
            alerts[env, camera] = outputs[row, 7] > 0.0

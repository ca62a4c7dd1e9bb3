"""The scalar half of a step: what one neuron does between and after the passes over its pixels.

The kernels keep one float64 row of scalars per neuron, whose first eight entries are the fields of
`Response` in order; `constants` packs parameters and frame rate for them.

numba's cache watches the file of a kernel alone: after a change here, delete __pycache__/*.nbi.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from lgmd_gym.neuron.params import LGMDParams

# One row of scalars: the Response, then the state, then a ring of the spikes of n_ts frames.
FREQUENCY, SPIKES, K, K_HAT, F, W, LATENCY, ALERT = range(8)
AGE, F_HAT, K_SUM, COUNT, GAIN_G, RING = range(8, 14)
RESPONSE = slice(0, 8)

# The row of constants.
(
    N_PIXELS, GAIN_F, T_F, SIGMA_1, SIGMA_2, TAU_G, DT, SIGMA_3, KEEP, T_SFA, SIGMA_4, T_SP, N_TS, RATE, T_SF,
    T_FFI, FFI_DELAY, LATENCY_JUMPS, WARM_START, MAX_SPIKES, DELTA_C, C_W, T_G, THETA_1, THETA_2, THETA_3,
    RESIDUE, TWO_TAP, N_P, GAIN_2, WEIGHT, TAP,
) = (*range(30), 32, 35)  # fmt: skip


def constants(params: LGMDParams, fps: float, n_pixels: int) -> NDArray[np.float64]:
    """Pack parameters at a frame rate in the order of the names above; the taps a_i come last.

    Args:
        params: The model's parameters.
        fps: Frames per second.
        n_pixels: n, the pixels over which F and K are means.
    """
    p, dt = params, params.frame_interval_ms(fps)
    keep = 0.0 if p.tau_s == 0.0 else 1.0 / (1.0 + dt / p.tau_s)
    rate = 1000.0 / dt if p.whole_ms else fps
    return np.array(
        [
            n_pixels, dt / (dt + p.tau_1), p.t_f, p.sigma_1, p.sigma_2, p.tau_g, dt, p.sigma_3, keep, p.t_sfa,
            p.sigma_4, p.t_sp, p.n_ts, rate, p.t_sf, p.t_ffi, p.ffi_delay, p.latency == "jump", p.warm_start,
            p.max_spikes, p.delta_c, p.c_w, p.t_de / p.c_de, p.theta_1, p.theta_2, p.theta_3,
            p.on_off_residue, p.delay == "two-tap", p.n_p, *(dt / (dt + tau) for tau in p.tau_2), *p.weights,
            *p.persistence,
        ]
    )  # fmt: skip


def resting(params: LGMDParams) -> NDArray[np.float64]:
    """The scalars of a neuron that has seen nothing, shape (RING + n_ts,)."""
    row = np.zeros(RING + params.n_ts)
    row[[K, K_HAT, W, LATENCY]] = params.k_0, params.k_0, params.sigma_1, params.tau_g
    return row


@njit(cache=True, nogil=True)
def feed_forward(row: NDArray, par: NDArray, sum_p: float | np.floating) -> None:
    """F, w and the latency of G from the sum of |P| (eq. 2 and 9)."""
    f_now, before = sum_p / par[N_PIXELS], row[F_HAT]
    gain = 1.0 if par[WARM_START] > 0.0 and row[AGE] == 1.0 else par[GAIN_F]
    row[F_HAT] = before + gain * (f_now - before)
    f = before if par[FFI_DELAY] > 0.0 else row[F_HAT]
    rest = 1.0 - f / par[T_F]
    low = rest < 0.0 if par[LATENCY_JUMPS] > 0.0 else rest < par[SIGMA_2]
    latency = par[TAU_G] * (par[SIGMA_2] if low else rest)
    row[F], row[W], row[LATENCY] = f, max(par[SIGMA_1], f / par[T_F]), latency
    row[GAIN_G] = par[DT] / (par[DT] + latency)


@njit(cache=True, nogil=True)
def fire(row: NDArray, par: NDArray, sum_g: float | np.floating) -> None:
    """K, its adaptation, spikes and their frequency from the sum of g (eq. 9 to 12).

    The latency filter of G has one gain for all pixels, so that filtering the sum is filtering the map.
    """
    row[K_SUM] += row[GAIN_G] * (sum_g - row[K_SUM])
    k = 1.0 / (1.0 + math.exp(-row[K_SUM] / (par[N_PIXELS] * par[SIGMA_3])))
    if row[F] >= par[T_FFI]:
        k = 0.5
    rise = k - row[K]
    adapted = par[KEEP] * (row[K_HAT] + rise if rise <= par[T_SFA] else k)
    row[K], row[K_HAT] = k, max(0.5, adapted)
    spikes = min(par[MAX_SPIKES], math.floor(math.exp(par[SIGMA_4] * (row[K_HAT] - par[T_SP]))))

    slot = RING + int(row[AGE]) % int(par[N_TS])
    row[COUNT] += spikes - row[slot]
    row[slot] = row[SPIKES] = spikes
    row[FREQUENCY] = row[COUNT] * par[RATE] / par[N_TS]
    row[ALERT] = 1.0 if row[FREQUENCY] >= par[T_SF] else 0.0
    row[AGE] += 1.0

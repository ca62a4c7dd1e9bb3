# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Scalar part of a step: feed-forward inhibition, membrane potential, spikes and spike frequency.

The scalar state of a neuron is one float64 row. Its first eight entries are the fields of `Response`, in
order. The constants are the parameters at a frame rate, packed into one float64 row.
"""

import math

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.kernels import kernel
from lgmd_gym.neuron.lgmd.params import LGMDParams

# Indices of the scalar state: Response, internal state, then a ring buffer of the spikes of `window` frames.
FREQUENCY, SPIKES, K, K_HAT, F, W, LATENCY, ALERT = range(8)
AGE, F_HAT, K_SUM, COUNT, GAIN_G, RING = range(8, 14)
RESPONSE = slice(0, 8)

# Indices of the constants; those of GAIN_2 and WEIGHT are three each, those of TAP the n_p taps a_i.
(
    N_PIXELS,
    GAIN_F,
    T_F,
    SIGMA_1,
    SIGMA_2,
    TAU_G,
    DT,
    SIGMA_3,
    KEEP,
    T_SFA,
    SIGMA_4,
    T_SP,
    N_TS,
    RATE,
    T_SF,
    T_FFI,
    LATENCY_JUMPS,
    WARM_START,
    DELTA_C,
    C_W,
    T_G,
    THETA_1,
    THETA_2,
    THETA_3,
    RESIDUE,
    TWO_TAP,
    N_P,
    FROM_K,
    WINDOW,
    GAIN_2,
) = range(30)
WEIGHT, TAP = GAIN_2 + 3, GAIN_2 + 6


def pack_constants(params: LGMDParams, fps: float, n_pixels: int) -> NDArray[np.float64]:
    """Return the constants of the kernels, indexed by the names above.

    Args:
        params: Parameters of the model.
        fps: Frame rate [Hz].
        n_pixels: Number of pixels n in the means F and K.
    """
    p, dt = params, params.frame_interval_ms(fps)
    values = {
        N_PIXELS: n_pixels,
        GAIN_F: dt / (dt + p.tau_1),
        T_F: p.t_f,
        SIGMA_1: p.sigma_1,
        SIGMA_2: p.sigma_2,
        TAU_G: p.tau_g,
        DT: dt,
        SIGMA_3: p.sigma_3,
        KEEP: 0.0 if p.tau_s == 0.0 else 1.0 / (1.0 + dt / p.tau_s),
        T_SFA: p.t_sfa,
        SIGMA_4: p.sigma_4,
        T_SP: p.t_sp,
        N_TS: p.n_ts,
        RATE: 1000.0 / dt if p.whole_ms else fps,
        T_SF: p.t_sf,
        T_FFI: p.t_ffi,
        LATENCY_JUMPS: p.latency == "jump",
        WARM_START: p.warm_start,
        DELTA_C: p.delta_c,
        C_W: p.c_w,
        T_G: p.t_de / p.c_de,
        THETA_1: p.theta_1,
        THETA_2: p.theta_2,
        THETA_3: p.theta_3,
        RESIDUE: p.on_off_residue,
        TWO_TAP: p.delay == "two-tap",
        N_P: p.n_p,
        FROM_K: p.spikes_from == "membrane",
        WINDOW: p.window,
    }
    const = np.zeros(TAP + p.n_p)
    const[list(values)] = list(values.values())
    const[GAIN_2:WEIGHT] = [dt / (dt + tau) for tau in p.tau_2]
    const[WEIGHT:TAP], const[TAP:] = p.weights, p.persistence
    return const


def initial_scalars(params: LGMDParams) -> NDArray[np.float64]:
    """Return the scalar state of a neuron before its first frame, shape (RING + window,)."""
    row = np.zeros(RING + params.window)
    row[[K, K_HAT, W, LATENCY]] = params.k_0, params.k_0, params.sigma_1, params.tau_g
    return row


@kernel(exact=True, arrays=True)
def feed_forward(row: NDArray, const: NDArray, sum_p: float | np.floating) -> None:
    """Update F, w and the latency of G from the sum of |P| (eq. 2 and 9)."""
    f_now, f_before = sum_p / const[N_PIXELS], row[F_HAT]
    gain = 1.0 if const[WARM_START] > 0.0 and row[AGE] == 1.0 else const[GAIN_F]
    row[F_HAT] = f_before + gain * (f_now - f_before)
    f = row[F_HAT]
    fraction = 1.0 - f / const[T_F]
    limited = fraction < 0.0 if const[LATENCY_JUMPS] > 0.0 else fraction < const[SIGMA_2]
    latency = const[TAU_G] * (const[SIGMA_2] if limited else fraction)
    row[F], row[W], row[LATENCY] = f, max(const[SIGMA_1], f / const[T_F]), latency
    row[GAIN_G] = const[DT] / (const[DT] + latency)


@kernel(exact=True, arrays=True)
def fire(row: NDArray, const: NDArray, sum_g: float | np.floating) -> None:
    """Update K, its adaptation, spikes, frequency and alert from the sum of g (eq. 9 to 12).

    The latency filter of G has one gain for all pixels, so filtering the sum is the sum of the filtered map.
    """
    row[K_SUM] += row[GAIN_G] * (sum_g - row[K_SUM])
    k = 1.0 / (1.0 + math.exp(-row[K_SUM] / (const[N_PIXELS] * const[SIGMA_3])))
    if row[F] >= const[T_FFI]:
        k = 0.5
    rise = k - row[K]
    adapted = const[KEEP] * (row[K_HAT] + rise if rise <= const[T_SFA] else k)
    row[K], row[K_HAT] = k, max(0.5, adapted)
    potential = row[K] if const[FROM_K] > 0.0 else row[K_HAT]
    spikes = math.floor(math.exp(const[SIGMA_4] * (potential - const[T_SP])))

    slot = RING + int(row[AGE]) % int(const[WINDOW])
    row[COUNT] += spikes - row[slot]
    row[slot] = row[SPIKES] = spikes
    row[FREQUENCY] = row[COUNT] * const[RATE] / const[N_TS]
    row[ALERT] = 1.0 if row[FREQUENCY] >= const[T_SF] else 0.0
    row[AGE] += 1.0

"""What spoils a picture: night, fog, sensor noise, vibration and brake dive."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numba as nb
import numpy as np

from lgmd_gym.camera.params import CameraParams
from lgmd_gym.camera.pinhole import CAM_CU, CAM_FOCAL
from lgmd_gym.camera.render.jit import kernel

# Layout of the vector of grey levels and conditions.
LOOK_GROUND, LOOK_SKY, LOOK_HAZE = 0, 5, 10
LOOK_EXTINCTION, LOOK_NIGHT, LOOK_PAVED, LOOK_SHOT, LOOK_READ = 11, 12, 13, 14, 15
LOOK_SHUTTER = 16
LOOK_SIZE = 17
ASPHALT_GREY, PAINT_GREY = 104.0, 208.0  # by day

_BEAM_REACH = 26.0  # the low beam falls to 1/e over this distance [m]
_BEAM_WIDTH = 0.26  # and to 1/e at this tangent of the angle off straight ahead
_BEAM_GAIN, _NIGHT_LIGHT = 1.25, 0.04
_NOISE_LOG2 = 17
_BODY_HZ = (1.1, 1.9, 3.4)  # bounce, pitch and wheel-hop side of a sprung body


def look_of(p: CameraParams) -> np.ndarray:
    """Grey levels and conditions for the kernels; float64, shape (17,)."""
    look = np.zeros(LOOK_SIZE)
    one_std = 1.0 / 36.0  # textures hold 36 per standard deviation
    look[0:5] = ASPHALT_GREY, 9.0 * p.texture * one_std, 76.0, 16.0 * p.texture * one_std, PAINT_GREY
    look[5:10] = 172.0, 214.0, 128.0, 78.0, 12.0
    look[LOOK_HAZE] = 200.0
    if p.light == "night":
        look[5:10] = 6.0, 14.0, 7.0, 4.0, 1.0
        look[LOOK_HAZE], look[LOOK_NIGHT] = 18.0, 1.0
    if p.visibility_m > 0.0:
        # Koschmieder: 5 % of the contrast is left at the visibility. Sky and skyline drown.
        look[LOOK_EXTINCTION] = math.log(20.0) / p.visibility_m
        _, left = far_veil(p)
        look[5:9] = look[LOOK_HAZE] + left * (look[5:9] - look[LOOK_HAZE])
        look[9] *= left
    look[LOOK_SHOT], look[LOOK_READ] = p.shot_noise, p.read_noise
    look[LOOK_SHUTTER] = p.shutter_s
    return look


def far_veil(p: CameraParams) -> tuple[float, float]:
    """Grey of the haze, and the share of sky and skyline that is left behind 500 m of it."""
    haze = 18.0 if p.light == "night" else 200.0
    return haze, math.exp(-500.0 * math.log(20.0) / p.visibility_m)


@kernel
def lamp_light(ahead, across, night):
    """Light at a place `ahead` and `across` of the lens: 1 by day, the low beam's by night."""
    if night == 0.0:
        return 1.0
    tan = across / max(ahead, 1.0)
    beam = math.exp(-max(ahead, 0.0) / _BEAM_REACH - (tan / _BEAM_WIDTH) ** 2)
    return _NIGHT_LIGHT + _BEAM_GAIN * beam


@kernel
def weather_row(grey, cam, ahead, look, beam):
    """Light a row of ground `ahead` metres away, and veil it with fog; changes `grey` in place."""
    if look[LOOK_NIGHT] > 0.0:
        gain = nb.float32(_BEAM_GAIN * math.exp(-ahead / _BEAM_REACH))
        rest = nb.float32(_NIGHT_LIGHT)
        for j in range(grey.shape[0]):
            grey[j] *= rest + gain * beam[j]
    if look[LOOK_EXTINCTION] > 0.0:
        clear = nb.float32(math.exp(-ahead * look[LOOK_EXTINCTION]))
        haze = nb.float32(look[LOOK_HAZE])
        for j in range(grey.shape[0]):
            grey[j] = haze + clear * (grey[j] - haze)


def beam_of(cam: np.ndarray, width: int) -> np.ndarray:
    """The low beam's fall-off over the columns of a frame; float32, shape (width,)."""
    tan = (np.arange(width) + 0.5 - cam[CAM_CU]) / cam[CAM_FOCAL]
    return np.exp(-((tan / _BEAM_WIDTH) ** 2)).astype(np.float32)


@kernel
def develop(out, image, look, noise, offset):
    """Turn light into grey values, with the sensor's noise.

    Args:
        out: uint8, shape (height, width).
        image: float32, shape (height, width).
        look: Conditions.
        noise: Standard normal numbers, float32, a power of two of them.
        offset: Where in them this frame starts.
    """
    height, width = out.shape
    zero, half, top = nb.float32(0.0), nb.float32(0.5), nb.float32(255.0)
    noisy = look[LOOK_SHOT] > 0.0 or look[LOOK_READ] > 0.0
    shot, read = nb.float32(look[LOOK_SHOT] ** 2 / 128.0), nb.float32(look[LOOK_READ] ** 2)
    mask = noise.shape[0] - 1
    for i in range(height):
        if noisy:
            for j in range(width):
                g = noise[(offset + i * width + j) & mask]
                image[i, j] += g * math.sqrt(read + shot * max(image[i, j], zero))
        for j in range(width):
            grey = image[i, j]
            grey = zero if grey < zero else top if grey > top else grey
            out[i, j] = np.uint8(grey + half)


@lru_cache(maxsize=4)
def noise_table(seed: int) -> np.ndarray:
    """Standard normal numbers, float32, shape (131072,)."""
    return np.random.default_rng([seed, 5]).standard_normal(1 << _NOISE_LOG2, dtype=np.float32)


def noise_offset(seed: int, ticks: int, x: float, y: float, heading: float) -> int:
    """Where this frame's noise starts: a function of seed and road state alone."""
    return hash((seed, ticks, x, y, heading)) & ((1 << _NOISE_LOG2) - 1)


def clock_of(env: Any) -> tuple[int, float]:
    """Simulation steps since the reset, and their time [s]; zeros where an environment keeps none."""
    base = getattr(env, "unwrapped", env)
    ticks = int(getattr(base, "steps", 0) or 0)
    rate = (getattr(base, "config", None) or {}).get("simulation_frequency", 30)
    return ticks, ticks / rate


def body_pitch(p: CameraParams, ego: Any, time_s: float) -> float:
    """Pitch of the car's body from an uneven road and from braking, upwards [rad]."""
    pitch = 0.0
    if p.vibration_deg > 0.0:
        pitch += _ride(p.vibration_deg, p.seed, ego, time_s, 0.37)
    if p.dive_deg > 0.0:
        demand = (getattr(ego, "action", None) or {}).get("acceleration", 0.0)
        pitch += p.dive_deg * max(-12.0, min(6.0, float(demand)))
    return math.radians(pitch)


def body_heave(p: CameraParams, ego: Any, time_s: float) -> float:
    """Rise of the car's body on an uneven road [m]."""
    return _ride(p.heave_m, p.seed, ego, time_s, 0.61) if p.heave_m > 0.0 else 0.0


def _ride(rms: float, seed: int, ego: Any, time_s: float, shift: float) -> float:
    """Sum of the body's own vibrations; `rms` is that at 14 m/s, and `shift` sets their phases apart.

    The height of a road has a spectrum that falls with the square of the spatial frequency (ISO 8608),
    so its variance above the body's frequency grows with the speed, and the RMS with its root.
    """
    rms = rms * math.sqrt(min(abs(float(ego.speed)), 60.0) / 14.0)
    phase = 0.1 * (seed % 10)
    turns = (hz * time_s + shift * k + phase for k, hz in enumerate(_BODY_HZ))
    return rms * math.sqrt(2.0 / 3.0) * sum(math.sin(2.0 * math.pi * turn) for turn in turns)

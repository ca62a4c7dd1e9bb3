"""Export of the LGMD as C99 source for robots and microcontrollers."""

import math
from importlib import resources
from pathlib import Path
from string import Template

from lgmd_gym._version import __version__
from lgmd_gym.errors import check_path
from lgmd_gym.neuron.lgmd.kernels import supports
from lgmd_gym.neuron.lgmd.params import LGMDParams, NeuronSpec
from lgmd_gym.neuron.validation import checked_fps, checked_shape

__all__ = ["FILES", "c_sources", "export_c"]

FILES = ("lgmd.h", "lgmd.c", "main.c")
MAX_SPIKES = 1_000_000  # of a frame, so that sums of a window fit into 32 bits
_S_BITS = 5  # fraction bits of S in fixed point


def export_c(
    folder: str | Path, shape: tuple[int, int], fps: float = 30.0, params: NeuronSpec = None
) -> list[Path]:
    """Write `lgmd.h`, `lgmd.c` and `main.c` to a folder and return their paths.

    Args:
        folder: Folder, which is created. The first two files are replaced; an existing `main.c` is kept.
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        params: Parameters of the neuron, or a mapping of them; None for the defaults.

    Raises:
        ValueError: For an argument out of range, or more than a million possible spikes per frame.
    """
    place = check_path("folder", folder)
    sources = c_sources(shape, fps, params)
    place.mkdir(parents=True, exist_ok=True)
    for name, text in sources.items():
        if name != "main.c" or not (place / name).exists():
            (place / name).write_text(text, encoding="utf-8")
    return [place / name for name in sources]


def c_sources(shape: tuple[int, int], fps: float = 30.0, params: NeuronSpec = None) -> dict[str, str]:
    """Return the text of each of `FILES`; arguments as of `export_c`."""
    values = _header_values(checked_shape(shape), checked_fps(fps), LGMDParams.make(params))
    texts = {name: resources.files(__name__).joinpath(name).read_text("utf-8") for name in FILES}
    return texts | {"lgmd.h": Template(texts["lgmd.h"]).substitute(values)}


def _header_values(shape: tuple[int, int], fps: float, params: LGMDParams) -> dict[str, str]:
    """Return the values of the placeholders in `lgmd.h`."""
    p, dt = params, params.frame_interval_ms(fps)
    spikes = math.exp(min(p.sigma_4 * (1.0 - p.t_sp), 700.0))
    if spikes > MAX_SPIKES:
        raise ValueError(
            f"sigma_4 = {p.sigma_4:g} and t_sp = {p.t_sp:g} allow {spikes:.3g} spikes per frame, at most "
            f"{MAX_SPIKES} can be exported; lower sigma_4"
        )
    numbers = {
        "fps": fps, "gain_f": dt / (dt + p.tau_1), "on_off_residue": p.on_off_residue, "theta_1": p.theta_1,
        "theta_2": p.theta_2, "theta_3": p.theta_3, "delta_c": p.delta_c, "c_w": p.c_w,
        "t_g": p.t_de / p.c_de, "t_f": p.t_f, "sigma_1": p.sigma_1, "sigma_2": p.sigma_2, "tau_g": p.tau_g,
        "dt": dt, "t_ffi": p.t_ffi, "sigma_3": p.sigma_3, "k_0": p.k_0,
        "keep": 0.0 if p.tau_s == 0.0 else 1.0 / (1.0 + dt / p.tau_s), "t_sfa": p.t_sfa,
        "sigma_4": p.sigma_4, "t_sp": p.t_sp, "t_sf": p.t_sf,
        "rate": (1000.0 / dt if p.whole_ms else fps) / p.n_ts,
    }  # fmt: skip
    whole = {
        "height": shape[0], "width": shape[1], "n_p": p.n_p, "warm_start": p.warm_start,
        "two_tap": p.delay == "two-tap", "has_residue": p.on_off_residue > 0.0,
        "latency_jumps": p.latency == "jump", "from_k": p.spikes_from == "membrane", "window": p.window,
    }  # fmt: skip
    lists = {
        "persistence": p.persistence or (0.0,),
        "gain_delay": tuple(dt / (dt + tau) for tau in p.tau_2),
        "weights": p.weights,
    }
    return {
        **{name: _c_number(value) for name, value in numbers.items()},
        **{name: str(int(value)) for name, value in whole.items()},
        **{name: ", ".join(map(_c_number, items)) for name, items in lists.items()},
        **_fixed_values(params, lists["gain_delay"]),
        "version": __version__,
    }


def _fixed_values(params: LGMDParams, gains: tuple[float, ...]) -> dict[str, str]:
    """Return the integer constants of fixed point; 0 for parameters that it does not cover."""
    p = params
    taps = (*p.persistence, 0.0, 0.0)[:2]
    largest = 255.0 / (1.0 - sum(p.persistence))  # of |P|
    fraction = min(math.floor(math.log2(32767.0 / largest)), 6) if supports(p) else 0
    thetas = [round(theta * 2.0 ** (12 + _S_BITS - fraction)) for theta in (p.theta_1, p.theta_2)]
    return {
        "fraction": str(fraction),
        "persistence_fixed": ", ".join(str(round(tap * 32768)) for tap in taps),
        "gain_delay_fixed": ", ".join(str(round(gain * 32768)) for gain in gains),
        "theta_on_fixed": f"{thetas[0]}u",
        "theta_off_fixed": f"{thetas[1]}u",
    }


def _c_number(value: float) -> str:
    """Return a C constant of type double with all digits."""
    return "INFINITY" if math.isinf(value) else repr(float(value))

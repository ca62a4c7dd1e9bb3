"""Parameters of the LGMD model, with symbols, units, equations and bounds."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Literal, Self, TypeAlias

import tomli_w

from lgmd_gym.aliases import Values
from lgmd_gym.errors import check_path
from lgmd_gym.fields import Record, choice, flag, number, numbers, record, whole
from lgmd_gym.processes.inputs import read_toml


@record
class LGMDParams(Record):
    """Parameters of the LGMD1 model of Fu et al. (AIAI 2019); the defaults are those of the paper.

    Equation numbers are those of the paper. "Y&R" marks the grouping layer of Yue & Rind (2006), "SFA" the
    spike frequency adaptation of Fu et al. (2018). Luminance is in grey levels, 0 to 255. An infinite time
    constant switches its filter off. A field with a default of `inf` has no effect by default.

    Raises:
        ValueError: For a value out of range or of another type.

    Example:
        >>> LGMDParams(t_sp=0.78).t_sp
        0.78
    """

    label = "LGMD"

    n_p: int = whole(2, "[0, 16]", "frames", "Number of persistent frames in P, open in the paper (eq. 1).")
    u: float = number(
        1.0,
        "[0, inf)",
        "",
        "Rate of the persistence a_i = 1 / (1 + exp(u * i)), i = 1..n_p; sum < 1 (eq. 1).",
    )
    tau_1: float = number(10.0, "[0, inf]", "ms", "Time constant of the feed-forward inhibition F (eq. 2).")
    tau_2: tuple[float, float, float] = numbers(
        (60.0, 120.0, 180.0),
        "[0, inf]",
        "ms",
        "Delays of the centre, nearest and diagonal part of I (eq. 4).",
    )
    weights: tuple[float, float, float] = numbers(
        (1.0, 0.25, 0.125),
        "[0, inf)",
        "",
        "Weights of the centre, each nearest and each diagonal pixel in I (eq. 5-6).",
    )
    theta_1: float = number(1.0, "[0, inf)", "", "Weight of the ON path in S (eq. 8).")
    theta_2: float = number(1.0, "[0, inf)", "", "Weight of the OFF path in S (eq. 8).")
    theta_3: float = number(
        1.0,
        "[0, inf)",
        "",
        "Weight of the product of both paths in S (eq. 8). It has no effect if on_off_residue is 0, because "
        "ON and OFF half-waves of the same P are disjoint.",
    )
    c_w: float = number(
        4.0, "(0, inf)", "", "Divisor of the largest local mean Ce in the grouping scale (Y&R)."
    )
    delta_c: float = number(0.01, "(0, inf)", "", "Smallest grouping scale (Y&R).")
    c_de: float = number(0.5, "(0, inf)", "", "Gain before the grouping threshold (Y&R).")
    t_de: float = number(
        15.0, "[0, inf)", "", "Grouping threshold, which passes g if g * c_de >= t_de (Y&R)."
    )
    t_f: float = number(
        20.0,
        "(0, inf]",
        "grey levels",
        "Scale of the adaptation to F: w = max(sigma_1, F / t_f), and the latency of G (eq. 9). If infinite, "
        "w = sigma_1 and the latency is tau_g.",
    )
    sigma_1: float = number(0.5, "[0, inf)", "", "Smallest inhibition weight w (eq. 9).")
    sigma_2: float = number(0.01, "[0, 1]", "", "Smallest latency of G as a fraction of tau_g (eq. 9).")
    tau_g: float = number(10.0, "[0, inf)", "ms", "Latency of the excitation G at F = 0 (eq. 9).")
    sigma_3: float = number(
        1.0,
        "(0, inf)",
        "",
        "Scale of the membrane potential, K = 1 / (1 + exp(-k / (n * sigma_3))) (eq. 10).",
    )
    tau_s: float = number(
        500.0, "[0, inf]", "ms", "Time constant of the adaptation of K (SFA). If infinite, K does not adapt."
    )
    t_sfa: float = number(0.003, "[0, inf)", "", "Rise of K per frame above which K does not adapt (SFA).")
    sigma_4: float = number(
        10.0,
        "[0, inf)",
        "",
        "Steepness of spiking; a frame has floor(exp(sigma_4 * (K_adapted - t_sp))) spikes (eq. 11).",
    )
    t_sp: float = number(0.7, "[0, 1]", "", "Adapted potential of the first spike in a frame (eq. 11).")
    n_ts: int = whole(6, "[1, 256]", "frames", "Number of frames over which spikes are counted (eq. 12).")
    t_sf: float = number(
        30.0,
        "(0, inf)",
        "spikes/s",
        "Spike frequency of the alert (eq. 12). The default applies to 30 frames per second, because spikes "
        "per frame do not scale with the frame interval.",
    )
    t_ffi: float = number(
        math.inf, "(0, inf]", "grey levels", "F at which K is set to 0.5, as in the earlier networks."
    )
    on_off_residue: float = number(
        0.0, "[0, 0.99]", "", "Fraction of the last value that an ON or OFF cell keeps (eq. 3)."
    )
    delay: Literal["recursive", "two-tap"] = choice(
        "recursive",
        ("recursive", "two-tap"),
        "Delay of E before I: a first-order low-pass, or gain * E(t) + (1 - gain) * E(t-1) (eq. 4).",
    )
    latency: Literal["clamp", "jump"] = choice(
        "clamp",
        ("clamp", "jump"),
        "Lower bound of the latency of G for F > t_f: limited to sigma_2 * tau_g, or set to that where "
        "1 - F / t_f < 0 (eq. 9).",
    )
    warm_start: bool = flag(
        True,
        "Whether the filters of E and F start at their first input instead of 0. If False, gratings cause "
        "spikes in the first frames.",
    )
    whole_ms: bool = flag(False, "Whether the frame interval is truncated to whole milliseconds.")
    spikes_from: Literal["adapted", "membrane"] = choice(
        "adapted",
        ("adapted", "membrane"),
        "Potential in the exponent of eq. 11: that after SFA, or K itself, as printed.",
    )
    extra_frame: bool = flag(
        False,
        "Whether the sum of eq. 12 has n_ts + 1 terms over n_ts frame intervals, as printed.",
    )
    k_0: float = number(0.5, "[0, 0.5]", "", "K and adapted K before the first change.")

    def check(self) -> None:
        """Refuse a persistence that does not decay."""
        total = sum(self.persistence)
        if total >= 1.0:
            raise ValueError(
                f"the persistence coefficients must sum to < 1, got {total:.3g} from u = {self.u:g} and "
                f"n_p = {self.n_p}; raise u or lower n_p"
            )

    @property
    def persistence(self) -> tuple[float, ...]:
        """Coefficients a_1..a_{n_p} of equation 1."""
        return tuple(1.0 / (1.0 + math.exp(min(self.u * i, 700.0))) for i in range(1, self.n_p + 1))

    @property
    def window(self) -> int:
        """Number of terms in the sum of equation 12 [frames]."""
        return self.n_ts + self.extra_frame

    def frame_interval_ms(self, fps: float) -> float:
        """Return the frame interval dt of the filters [ms] at a frame rate [Hz]."""
        return float(math.floor(1000.0 / fps)) if self.whole_ms else 1000.0 / fps

    def max_spike_frequency(self, fps: float) -> float:
        """Return the upper bound of the spike frequency [spikes/s], from K <= 1 and K̂ <= τ_s / (τ_s + dt)."""
        interval_ms = self.frame_interval_ms(fps)
        adapts = self.spikes_from == "adapted" and not math.isinf(self.tau_s)
        highest = self.tau_s / (self.tau_s + interval_ms) if adapts else 1.0
        spikes = math.floor(math.exp(self.sigma_4 * (highest - self.t_sp)))
        return spikes * self.window / self.n_ts * 1000.0 / interval_ms

    @classmethod
    def literal(cls) -> Self:
        """Return the parameters for the equations as printed in the paper.

        Spikes follow from K instead of the adapted potential (eq. 11), the sum of eq. 12 has seven terms, and
        the filters start at 0. The page on the neuron has the effect of each of these deviations.
        """
        return cls(spikes_from="membrane", extra_frame=True, warm_start=False)

    @classmethod
    def released(cls) -> Self:
        """Return the parameters of the first author's C# release of 2019.

        The release differs from the paper: no persistence, ON and OFF cells that keep a tenth of their last
        value, a two-tap delay, no product of the paths, the "jump" latency rule, a higher spike threshold
        and no warm start.
        """
        return cls(
            n_p=0, on_off_residue=0.1, delay="two-tap", theta_3=0.0, delta_c=0.5, latency="jump", sigma_2=0.5,
            t_sp=0.78, whole_ms=True, k_0=0.0, warm_start=False,
        )  # fmt: skip

    @classmethod
    def fixed_inhibition(cls) -> Self:
        """Return the ablation without adaptation to F; a high F silences the cell instead.

        w = sigma_1 and the latency is tau_g for every F (t_f is infinite). F >= t_ffi sets K to 0.5, as in
        the earlier networks. t_ffi = 20 is this package's choice, equal to the paper's t_f. The result is
        not the LGMD1 of Yue & Rind.
        """
        return cls(t_f=math.inf, t_ffi=20.0)

    @classmethod
    def off_only(cls) -> Self:
        """Return the model without its ON path; like LGMD2, it responds to dark objects only."""
        return cls(theta_1=0.0)

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """Read a TOML file of `name = value` lines; missing fields keep their defaults.

        Raises:
            ValueError: For a file that is not TOML, an unknown key or a value out of range.
        """
        file = check_path("path", path)
        try:
            values = read_toml(file)
        except OSError as error:
            raise ValueError(f"params file {str(file)!r} cannot be read: {error.strerror}") from None
        except ValueError as error:
            raise ValueError(f"params file {str(file)!r} must be a TOML file: {error}") from None
        return cls.make(values)

    def to_toml(self, path: str | Path) -> None:
        """Write every field to a TOML file, which `from_toml` reads."""
        Path(path).write_text(tomli_w.dumps(self.to_dict()), encoding="utf-8")


PRESETS: dict[str, Callable[[], LGMDParams]] = {
    "literal": LGMDParams.literal,
    "released": LGMDParams.released,
    "fixed-inhibition": LGMDParams.fixed_inhibition,
    "off-only": LGMDParams.off_only,
}
"""Named parameter sets of the LGMD, each also the name of a registered neuron model."""


def preset_changes(name: str) -> Values:
    """Return the fields of a preset that differ from the defaults, as plain values."""
    defaults = LGMDParams().to_dict()
    return {key: item for key, item in PRESETS[name]().to_dict().items() if item != defaults[key]}


NeuronSpec: TypeAlias = LGMDParams | Mapping[str, object] | None
"""The `params` argument of neurons, environments and wrappers; None for the default parameters."""

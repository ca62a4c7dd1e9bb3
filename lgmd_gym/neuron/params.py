"""Parameters of the LGMD model, with symbols, units, equations and bounds."""

import dataclasses
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Self, TypeAlias

import tomli_w

from lgmd_gym.errors import check_keys, check_path
from lgmd_gym.neuron.bounds import checked_field, made_params


@dataclass(frozen=True, slots=True, kw_only=True)
class LGMDParams:
    """Parameters of the LGMD1 model of Fu et al. (AIAI 2019); the defaults are those of the paper.

    Equation numbers are those of the paper. "Y&R" marks the grouping layer of Yue & Rind (2006), "SFA" the
    spike frequency adaptation of Fu et al. (2018). Luminance is in grey levels, 0 to 255. An infinite time
    constant switches its filter off. A field with a default of `inf` has no effect by default.

    Attributes:
        n_p: Number of persistent frames in P (eq. 1); default 2 (open in the paper), 0 to 16.
        u: Rate of the persistence, a_i = 1 / (1 + exp(u * i)) for i = 1..n_p (eq. 1); default 1, >= 0. The
            sum of all a_i must be < 1.
        tau_1: Time constant of the feed-forward inhibition F [ms] (eq. 2); default 10, >= 0.
        tau_2: Delays of the centre, nearest and diagonal contributions to I [ms] (eq. 4); default 60, 120
            and 180, >= 0.
        weights: Weights of the centre, of each nearest and of each diagonal neighbour in I (eq. 5-6);
            default 1, 1/4 and 1/8, >= 0.
        theta_1: Weight of the ON path in S (eq. 8); default 1, >= 0.
        theta_2: Weight of the OFF path in S (eq. 8); default 1, >= 0.
        theta_3: Weight of the product of both paths in S (eq. 8); default 1, >= 0. It has no effect if
            `on_off_residue` is 0, because ON and OFF half-waves of the same P are disjoint.
        c_w: Divisor of the largest local mean Ce in the grouping scale (Y&R); default 4, > 0.
        delta_c: Smallest grouping scale (Y&R); default 0.01, > 0.
        c_de: Gain before the grouping threshold (Y&R); default 0.5, > 0.
        t_de: Grouping threshold, which passes g if g * c_de >= t_de (Y&R); default 15, >= 0.
        t_f: Scale of the adaptation to F [grey levels]; default 20, > 0. It sets w = max(sigma_1, F / t_f)
            and the latency of G (eq. 9). If infinite, w = sigma_1 and the latency is tau_g.
        sigma_1: Smallest inhibition weight w (eq. 9); default 0.5, >= 0.
        sigma_2: Smallest latency of G as a fraction of tau_g (eq. 9); default 0.01, 0 to 1.
        tau_g: Latency of the excitation G at F = 0 [ms] (eq. 9); default 10, >= 0.
        sigma_3: Scale of the membrane potential, K = 1 / (1 + exp(-k / (n * sigma_3))) (eq. 10); default 1,
            > 0.
        tau_s: Time constant of the adaptation of K [ms] (SFA); default 500, >= 0. If infinite, K does not
            adapt.
        t_sfa: Rise of K per frame above which K does not adapt (SFA); default 0.003, >= 0.
        sigma_4: Steepness of spiking; a frame has floor(exp(sigma_4 * (K_adapted - t_sp))) spikes
            (eq. 11); default 10, >= 0.
        t_sp: Adapted potential of the first spike in a frame (eq. 11); default 0.7, 0 to 1.
        n_ts: Number of frames over which spikes are counted (eq. 12); default 6, 1 to 256.
        t_sf: Spike frequency of the alert [spikes/s] (eq. 12); default 30, > 0. It applies to 30 frames
            per second, because spikes per frame do not scale with the frame interval.
        t_ffi: F at which K is set to 0.5, as in the earlier networks [grey levels]; default `inf`, > 0.
        ffi_delay: Delay of F [frames]; default 0, 0 or 1 (1 in Yue & Rind 2006).
        on_off: Whether P is split into ON and OFF half-waves (eq. 3); default True. If False, E = P and
            S = E - w * I are signed, and theta_1, theta_2, theta_3 and on_off_residue have no effect.
        on_off_residue: Fraction of the last value that an ON or OFF cell keeps (eq. 3); default 0, 0 to
            0.99.
        delay: Delay of E before I (eq. 4): "recursive", a first-order low-pass, or "two-tap",
            gain * E(t) + (1 - gain) * E(t-1); default "recursive".
        latency: Lower bound of the latency of G for F > t_f (eq. 9): "clamp" limits it to
            sigma_2 * tau_g; "jump" sets it to sigma_2 * tau_g where 1 - F / t_f < 0; default "clamp".
        warm_start: Whether the filters of E and F start at their first input instead of 0; default True.
            If False, gratings cause spikes in the first frames.
        whole_ms: Whether the frame interval is truncated to whole milliseconds; default False.
        spikes_from: Potential in the exponent of eq. 11: "adapted", that after SFA, or "membrane", K itself,
            as printed; default "adapted".
        extra_frame: Whether the sum of eq. 12 has n_ts + 1 terms over n_ts frame intervals, as printed;
            default False: n_ts terms.
        max_spikes: Largest number of spikes of a frame; default `inf`, >= 1.
        k_0: K and adapted K before the first change; default 0.5, 0 to 0.5.

    Raises:
        ValueError: For a value out of range or of another type.

    Example:
        >>> LGMDParams(t_sp=0.78).t_sp
        0.78
    """

    n_p: int = 2
    u: float = 1.0
    tau_1: float = 10.0
    tau_2: tuple[float, float, float] = (60.0, 120.0, 180.0)
    weights: tuple[float, float, float] = (1.0, 0.25, 0.125)
    theta_1: float = 1.0
    theta_2: float = 1.0
    theta_3: float = 1.0
    c_w: float = 4.0
    delta_c: float = 0.01
    c_de: float = 0.5
    t_de: float = 15.0
    t_f: float = 20.0
    sigma_1: float = 0.5
    sigma_2: float = 0.01
    tau_g: float = 10.0
    sigma_3: float = 1.0
    tau_s: float = 500.0
    t_sfa: float = 0.003
    sigma_4: float = 10.0
    t_sp: float = 0.7
    n_ts: int = 6
    t_sf: float = 30.0
    t_ffi: float = math.inf
    ffi_delay: int = 0
    on_off: bool = True
    on_off_residue: float = 0.0
    delay: Literal["recursive", "two-tap"] = "recursive"
    latency: Literal["clamp", "jump"] = "clamp"
    warm_start: bool = True
    whole_ms: bool = False
    spikes_from: Literal["adapted", "membrane"] = "adapted"
    extra_frame: bool = False
    max_spikes: float = math.inf
    k_0: float = 0.5

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = checked_field(field.name, field.default, getattr(self, field.name))
            object.__setattr__(self, field.name, value)
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
        return min(spikes, self.max_spikes) * self.window / self.n_ts * 1000.0 / interval_ms

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
    def yue_rind2006(cls) -> Self:
        """Return the earlier LGMD1 of Yue & Rind (IEEE Trans. Neural Networks 2006), for comparison.

        P(t) = L(t) - L(t-1) + sum p_i P(t-i); E is the signed P; I is the sum of P(t-1) over the eight
        neighbours, weighted 1/4 (nearest) and 1/8 (diagonal), without the centre; S = E - w I; the grouping
        layer is that of `LGMDParams`; K = 1 / (1 + exp(-sum G / n)); each frame with K >= t_sp has one
        spike; four spikes in a row are an alert; mean|P(t-1)| >= t_ffi silences the cell. There are no ON
        and OFF paths, no adaptation and no latency.

        These equations are from memory and not checked against the printed paper. The kernel without a
        centre, the signed E and t_ffi = 10 agree with the C# code of the same network that Q. Fu released
        in 2019. The following values are from memory alone: w = 0.3; one persistent frame; a constant
        t_sp = 0.86 (the original varies between 0.80 and 0.90 with the scene); a constant t_ffi (the
        original follows F by 2 %); four spikes in a row, which is t_sf = 25 at 25 frames per second.
        """
        return cls(
            n_p=1, tau_1=0.0, tau_2=(math.inf, math.inf, math.inf), weights=(0.0, 0.25, 0.125),
            delay="two-tap", on_off=False, sigma_1=0.3, t_f=math.inf, tau_g=0.0, tau_s=math.inf, t_sp=0.86,
            max_spikes=1.0, n_ts=4, t_sf=25.0, t_ffi=10.0, ffi_delay=1, warm_start=False,
        )  # fmt: skip

    @classmethod
    def make(cls, spec: "NeuronSpec") -> Self:
        """Return the parameters for a `params` argument: an instance, a mapping, or None for the defaults.

        Raises:
            ValueError: For an unknown key, a value out of range, or another type.
        """
        return made_params(cls, spec, cls.from_dict)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return parameters from plain values; missing fields keep their defaults.

        Raises:
            ValueError: For an unknown key or a value out of range.
        """
        check_keys("LGMD parameter", values, (field.name for field in dataclasses.fields(cls)))
        return cls(**values)

    def to_dict(self) -> dict[str, Any]:
        """Return every field as a plain value; tuples become lists, as in TOML and JSON."""
        return {k: list(v) if isinstance(v, tuple) else v for k, v in dataclasses.asdict(self).items()}

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """Read a TOML file of `name = value` lines; missing fields keep their defaults.

        Raises:
            ValueError: For a file that is not TOML, an unknown key or a value out of range.
        """
        file = check_path("path", path)
        try:
            values = tomllib.loads(file.read_text(encoding="utf-8"))
        except OSError as error:
            raise ValueError(f"params file {str(file)!r} cannot be read: {error.strerror}") from None
        except ValueError as error:
            raise ValueError(f"params file {str(file)!r} must be a TOML file: {error}") from None
        return cls.from_dict(values)

    def to_toml(self, path: str | Path) -> None:
        """Write every field to a TOML file, which `from_toml` reads."""
        Path(path).write_text(tomli_w.dumps(self.to_dict()), encoding="utf-8")


NeuronSpec: TypeAlias = LGMDParams | Mapping[str, Any] | None
"""The `params` argument of neurons, environments and wrappers; None for the default parameters."""

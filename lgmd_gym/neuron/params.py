"""The parameters of the LGMD model: every symbol, its unit, its equation, its bounds."""

import dataclasses
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Self, TypeAlias

from lgmd_gym.errors import check_keys
from lgmd_gym.neuron.bounds import checked


@dataclass(frozen=True, slots=True, kw_only=True)
class LGMDParams:
    """Every symbol of the LGMD1 model of Fu et al. (AIAI 2019); the defaults are the paper's.

    Equation numbers are the paper's. "Y&R" marks the grouping layer of Yue & Rind (2006), "SFA" the
    spike frequency adaptation of Fu et al. (2018); luminance is in 0-255 throughout. Times are in
    milliseconds, and an infinite one switches its filter off.

    Attributes:
        n_p: Frames that persist in the photoreceptors (eq. 1); default 2, open in the paper.
        u: Rate of that persistence, a_i = 1 / (1 + exp(u * i)) for i = 1..n_p (eq. 1); default 1.
        tau_1: Time constant of the feed-forward inhibition F [ms] (eq. 2); default 10.
        tau_2: Delays of the centre, nearest and diagonal contributions to I [ms] (eq. 4); default 60, 120
            and 180.
        weights: Weights of the centre, each nearest and each diagonal neighbour in I (eq. 5-6); default
            1, 1/4 and 1/8.
        theta_1: Weight of the ON path in S (eq. 8); default 1.
        theta_2: Weight of the OFF path in S (eq. 8); default 1.
        theta_3: Weight of the product of both paths in S (eq. 8); default 1. Inert when
            `on_off_residue` is 0: the half-waves of one P are disjoint, so that S_on * S_off = 0.
        c_w: Divisor of the largest local mean Ce in the grouping scale (Y&R); default 4.
        delta_c: Smallest grouping scale (Y&R); default 0.01.
        c_de: Gain ahead of the grouping threshold (Y&R); default 0.5.
        t_de: Grouping threshold, g is kept where g * c_de >= t_de (Y&R); default 15.
        t_f: Scale of the adaptation to F: w = max(sigma_1, F / t_f) and the latency of G (eq. 9) [luminance];
            default 20. Infinite: nothing adapts, w = sigma_1 and the latency is tau_g.
        sigma_1: Least inhibition weight w (eq. 9); default 0.5.
        sigma_2: Least latency of G as a fraction of tau_g (eq. 9); default 0.01.
        tau_g: Latency of the excitation G at F = 0 [ms] (eq. 9); default 10.
        sigma_3: Scale of the membrane potential, K = 1 / (1 + exp(-k / (n * sigma_3))) (eq. 10); default 1.
        tau_s: Time constant of the adaptation of K [ms] (SFA); default 500. Infinite: no adaptation.
        t_sfa: Rise of K per frame above which it does not adapt (SFA); default 0.003.
        sigma_4: Steepness of the spiking, floor(exp(sigma_4 * (K_adapted - t_sp))) a frame (eq. 11);
            default 10.
        t_sp: Adapted potential at which the first spike of a frame falls (eq. 11); default 0.7.
        n_ts: Frames over which spikes are counted (eq. 12); default 6.
        t_sf: Spike frequency from which the neuron alerts [spikes/s] (eq. 12); default 30. Fits 30 frames
            a second: spikes a frame are not scaled by dt, so read it together with fps.
        t_ffi: F from which the cell is silenced, K = 0.5, as in the earlier networks [luminance]; default
            infinite, never.
        ffi_delay: Frames by which F reaches the cell late; default 0 (Yue & Rind 2006: 1).
        on_off: Whether P is split in ON and OFF half-waves (eq. 3); default True. Without, E = P with its
            sign, S = E - w * I with its sign, and theta_1..theta_3 do not act.
        on_off_residue: Part of its last value that an ON or OFF cell keeps (eq. 3); default 0.
        delay: How E is delayed ahead of I (eq. 4): "recursive", the first-order low-pass, or "two-tap",
            gain * E(t) + (1 - gain) * E(t-1); default "recursive".
        latency: What bounds the latency of G when F > t_f (eq. 9): "clamp", at sigma_2 * tau_g from below,
            or "jump", to sigma_2 * tau_g only once 1 - F / t_f < 0; default "clamp".
        warm_start: Whether the filters of E and F start at their first input instead of 0; default True.
            Without, gratings fire in their first frames.
        whole_ms: Whether the frame interval is cut to whole milliseconds; default False.
        max_spikes: Most spikes of one frame; default infinite.
        k_0: K and its adapted value before the first change; default 0.5.

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
    max_spikes: float = math.inf
    k_0: float = 0.5

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = checked(field.name, field.default, getattr(self, field.name))
            object.__setattr__(self, field.name, value)
        total = sum(self.persistence)
        if total >= 1.0:
            raise ValueError(
                f"u = {self.u:g} with n_p = {self.n_p}: the persistence coefficients sum to {total:.3g}, "
                "which must be < 1 or P grows without bound; raise u or lower n_p"
            )

    @property
    def persistence(self) -> tuple[float, ...]:
        """The coefficients a_1..a_{n_p} of equation 1."""
        return tuple(1.0 / (1.0 + math.exp(min(self.u * i, 700.0))) for i in range(1, self.n_p + 1))

    def frame_interval_ms(self, fps: float) -> float:
        """The frame interval dt [ms] that the filters see at `fps` frames a second."""
        return float(math.floor(1000.0 / fps)) if self.whole_ms else 1000.0 / fps

    @classmethod
    def released(cls) -> Self:
        """The model as the first author released it in C# in 2019.

        No persistence, ON and OFF cells that keep a tenth of their last value, a two-tap delay, no
        product of the paths, another latency rule, a higher spike threshold, no warm start.
        """
        return cls(
            n_p=0, on_off_residue=0.1, delay="two-tap", theta_3=0.0, delta_c=0.5, latency="jump", sigma_2=0.5,
            t_sp=0.78, whole_ms=True, k_0=0.0, warm_start=False,
        )  # fmt: skip

    @classmethod
    def fixed_inhibition(cls) -> Self:
        """The ablation of what the paper adds: nothing adapts to F, which silences the cell instead.

        w = sigma_1 and the latency is tau_g whatever F (t_f infinite), and F >= t_ffi sets K to 0.5, as
        in the earlier networks. t_ffi = 20 is our choice, the paper's t_f. Not the LGMD1 of Yue & Rind.
        """
        return cls(t_f=math.inf, t_ffi=20.0)

    @classmethod
    def off_only(cls) -> Self:
        """Only the OFF path: sees dark objects, in the manner of LGMD2."""
        return cls(theta_1=0.0)

    @classmethod
    def yue_rind2006(cls) -> Self:
        """The earlier LGMD1 of Yue & Rind (IEEE Trans. Neural Networks 2006), for comparison.

        P(t) = L(t) - L(t-1) + sum p_i P(t-i); E = P with its sign; I = sum over the eight neighbours of
        P(t-1), 1/4 nearest, 1/8 diagonal, none from the centre; S = E - w I; the grouping layer as
        here; K = 1 / (1 + exp(-sum G / n)); a spike a frame while K >= t_sp; four in a row alert;
        mean|P(t-1)| >= t_ffi silences. No ON and OFF paths, no adaptation, no latency.

        The equations are from memory, not checked against the print; the kernel without a centre, the
        signed E and t_ffi = 10 agree with the C# of the same network that Q. Fu released in 2019. From
        memory alone: w = 0.3; one persistent frame; t_sp = 0.86, which theirs lets wander between 0.80
        and 0.90 with the scene and which stands still here; a fixed t_ffi, which theirs lets follow F by
        2 %; four spikes in a row, t_sf = 25 at their 25 frames a second.
        """
        return cls(
            n_p=1, tau_1=0.0, tau_2=(math.inf, math.inf, math.inf), weights=(0.0, 0.25, 0.125),
            delay="two-tap", on_off=False, sigma_1=0.3, t_f=math.inf, tau_g=0.0, tau_s=math.inf, t_sp=0.86,
            max_spikes=1.0, n_ts=4, t_sf=25.0, t_ffi=10.0, ffi_delay=1, warm_start=False,
        )  # fmt: skip

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Build from plain values; what is missing keeps its default.

        Raises:
            ValueError: For an unknown key, naming the nearest, or a value out of bounds.
        """
        check_keys("LGMD parameter", values, (field.name for field in dataclasses.fields(cls)))
        return cls(**values)

    def to_dict(self) -> dict[str, Any]:
        """Every field as a plain value; tuples become lists, as TOML and JSON have them."""
        return {k: list(v) if isinstance(v, tuple) else v for k, v in dataclasses.asdict(self).items()}

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """Read a TOML file of `name = value` lines; what is missing keeps its default.

        Raises:
            ValueError: For a file that is no TOML, an unknown key or a value out of bounds.
        """
        try:
            values = tomllib.loads(Path(path).read_text(encoding="utf-8"))
        except tomllib.TOMLDecodeError as error:
            raise ValueError(f"{path} is not TOML: {error}") from error
        return cls.from_dict(values)

    def to_toml(self, path: str | Path) -> None:
        """Write every field to a TOML file that `from_toml` reads back unchanged."""
        lines = (f"{name} = {_toml(value)}\n" for name, value in self.to_dict().items())
        Path(path).write_text("".join(lines), encoding="utf-8")


def _toml(value: Any) -> str:
    """`value` as a TOML literal."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    return repr(value)


NeuronSpec: TypeAlias = LGMDParams | Mapping[str, Any] | None
"""The `params` argument of environments and wrappers; None for the default parameters."""

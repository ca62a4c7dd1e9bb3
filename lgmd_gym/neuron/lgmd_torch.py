"""Differentiable LGMD in PyTorch: the equations of the reference model on batches of clips.

This module requires PyTorch (extra `train`); `lgmd_gym` and `lgmd_gym.neuron` do not import it. The layer
computes what `lgmd_gym.neuron.lgmd.reference` computes, frame by frame, on any device. With `softness`
its thresholds become smooth, so that a loss on the spikes has gradients; `to_params` returns the fitted
parameters for the compiled neuron.
"""

import math
from collections.abc import Collection
from dataclasses import replace
from typing import NamedTuple, cast

import torch
from torch import Tensor, nn
from torch.nn import functional

from lgmd_gym.errors import check_items, check_known
from lgmd_gym.fields import Declaration, Record, declarations, flag, number, record
from lgmd_gym.neuron.lgmd.params import LGMDParams, NeuronSpec
from lgmd_gym.neuron.validation import checked_fps

LEARNABLE: dict[str, Declaration] = {
    item.name: item for item in declarations(LGMDParams) if isinstance(item.default, (float, tuple))
}
"""Declarations of the parameters that can be learned: all real numbers of `LGMDParams`."""

_OPEN_END = 1e-6  # distance kept from an end that does not belong to a range


@record
class Softness(Record):
    """Widths of the smooth thresholds of a differentiable LGMD.

    A threshold becomes a logistic function, a lower bound a softplus. The smaller the width, the closer the
    outputs are to those of the hard model, and the fewer values have a gradient.
    """

    label = "softness"

    grouping: float = number(3.0, "(0, inf)", "", "Width of the grouping threshold, in units of g * c_de.")
    adaptation: float = number(0.001, "(0, inf)", "", "Width of the threshold t_sfa, in units of K.")
    silence: float = number(1.0, "(0, inf)", "grey levels", "Width of the threshold t_ffi.")
    floor: float = number(0.01, "(0, inf)", "", "Width of the lower bound 0.5 of the adapted potential.")
    spikes: float = number(
        0.1,
        "(0, inf)",
        "spikes",
        "Width of the lower bound 0 of the spikes of a frame. In place of floor(x), a frame has x - 1/2 "
        "spikes, the mean of floor(x + d) over a uniform d in [-1/2, 1/2].",
    )
    surrogate: bool = flag(
        False,
        "Whether only the gradients are smooth (surrogate gradients), and the outputs those of the "
        "hard model.",
    )


class LayerResponse(NamedTuple):
    """Outputs of `LGMDLayer`, of shape (N,) for a step and (N, T) for clips; see `Response`."""

    spike_frequency: Tensor  # spikes/s
    spikes: Tensor  # of the frame; a whole number without softness
    membrane_potential: Tensor  # K
    adapted_potential: Tensor  # K after adaptation
    ffi: Tensor  # F [grey levels]
    inhibition_weight: Tensor  # w
    excitation_latency: Tensor  # latency of G [ms]
    alert: Tensor  # bool, whether spike_frequency >= t_sf


class LayerState(NamedTuple):
    """State of N neurons between two frames."""

    age: int  # number of frames so far
    luminance: Tensor  # last frame (N, H, W)
    past_p: Tensor  # P of the last n_p frames, newest first (N, n_p, H, W)
    paths: Tensor  # E of the ON and the OFF path (N, 2, H, W)
    delayed: Tensor  # memory of the delay per ring of neighbours and path (3, N, 2, H, W)
    g: Tensor  # G (N, H, W)
    f: Tensor  # F (N,)
    k: Tensor  # K (N,)
    k_hat: Tensor  # K after adaptation (N,)
    window: Tensor  # spikes of the last frames, newest last (N, window)

    def detach(self) -> "LayerState":
        """Return the state without its gradients, for truncated backpropagation through time."""
        return LayerState(self.age, *(item.detach() for item in self[1:]))


class LGMDLayer(nn.Module):
    """LGMD neurons whose parameters can be learned.

    Without `softness` the outputs are those of the reference model, and gradients pass only through values
    above the thresholds; spikes have none. With `softness` all outputs but the alert have gradients, which
    are surrogates of hard thresholds if it says so.

    Each learned parameter is an `nn.Parameter` with the value divided by its start, so that one learning
    rate suits all. `values` has the values in their units. Call `clamp_` after each step of the optimizer.

    Args:
        fps: Frame rate [Hz].
        params: Parameters at the start, or a mapping of them; None for the defaults.
        learn: Names of the learned parameters, see `LEARNABLE`.
        softness: Widths of the thresholds, or a mapping of them; None for hard thresholds.
        mask: Pixel weights in [0, 1], shape (H, W); None for 1.

    Attributes:
        fps: Frame rate [Hz].
        params: Parameters at the start.
        softness: Widths of the thresholds; None for hard ones.
        learned: The learned parameters by name, as multiples of their start.

    Raises:
        ValueError: For an unknown name or a value out of range.

    Example:
        >>> layer = LGMDLayer(fps=30.0, learn=["sigma_3", "tau_2"])
        >>> response, state = layer(torch.zeros(4, 10, 24, 32))  # N, T, H, W
        >>> response.membrane_potential.shape
        torch.Size([4, 10])
    """

    def __init__(
        self,
        fps: float = 30.0,
        params: NeuronSpec = None,
        learn: Collection[str] = (),
        softness: Softness | dict[str, float] | None = None,
        mask: Tensor | None = None,
    ) -> None:
        super().__init__()
        self.fps = checked_fps(fps)
        self.params = LGMDParams.make(params)
        self.softness = None if softness is None else Softness.make(softness)
        self.learned = nn.ParameterDict()
        for name in check_items("learn", tuple(learn), str, "names"):
            check_known("learnable parameter", name, LEARNABLE)
            start = torch.tensor(getattr(self.params, name))
            if not torch.isfinite(start).all():
                raise ValueError(f"{name} = inf cannot be learned; start from a finite value in params")
            self.learned[name] = nn.Parameter(start / _scale(start))
        self.mask: Tensor | None
        self.register_buffer("mask", mask)

    def values(self, like: Tensor | None = None) -> dict[str, Tensor]:
        """Return every real parameter in its unit, of shape () or (3,); learned ones have gradients.

        Args:
            like: Tensor of the wanted dtype and device; None for those of the learned parameters.
        """
        if like is None:
            like = next(iter(self.parameters()), torch.zeros(()))
        found: dict[str, Tensor] = {}
        for name in LEARNABLE:
            value = torch.tensor(getattr(self.params, name), dtype=like.dtype, device=like.device)
            found[name] = self.learned[name].to(value) * _scale(value) if name in self.learned else value
        return found

    def to_params(self) -> LGMDParams:
        """Return the current parameters, within their bounds, for the compiled `LGMD(shape, fps, params)`."""
        with torch.no_grad():
            values = self.values(torch.zeros((), dtype=torch.float64))
        current = {name: _plain(_within_bounds(name, values[name])) for name in self.learned}
        return replace(self.params, **current)

    @torch.no_grad()
    def clamp_(self) -> "LGMDLayer":
        """Move learned parameters that are out of range to the nearest end of it; return the layer."""
        for name, parameter in self.learned.items():
            scale = _scale(torch.tensor(getattr(self.params, name)).to(parameter))
            parameter.copy_(_within_bounds(name, parameter * scale) / scale)
        return self

    def forward(self, frames: Tensor, state: LayerState | None = None) -> tuple[LayerResponse, LayerState]:
        """Process clips; return the outputs of shape (N, T) and the state after the last frame.

        Args:
            frames: Luminance in 0-255, uint8 or float, shape (N, T, H, W).
            state: State before the first frame; None to start.

        Raises:
            ValueError: For frames of another shape, without a frame, or scaled to 0-1.
        """
        _check_clips(frames)
        luminance = self._luminance(frames)
        values = self.values(luminance)
        responses: list[LayerResponse] = []
        for frame in luminance.unbind(1):
            response, state = self._step(frame, state, values)
            responses.append(response)
        assert state is not None
        columns = cast(list[list[Tensor]], [list(column) for column in zip(*responses, strict=True)])
        return LayerResponse(*(torch.stack(column, dim=1) for column in columns)), state

    def step(self, frame: Tensor, state: LayerState | None = None) -> tuple[LayerResponse, LayerState]:
        """Process one frame of N clips; return the outputs of shape (N,) and the new state.

        Args:
            frame: Luminance in 0-255, uint8 or float, shape (N, H, W). The values are not checked.
            state: State after the frame before; None for the first frame.
        """
        if frame.ndim != 3:
            raise ValueError(f"frame must have the shape (N, height, width), got {tuple(frame.shape)}")
        luminance = self._luminance(frame)
        return self._step(luminance, state, self.values(luminance))

    def _luminance(self, frames: Tensor) -> Tensor:
        """Return weighted frames in the dtype of the computation: theirs, or for uint8 the parameters'."""
        if not frames.is_floating_point():
            learned = next(iter(self.parameters()), None)
            frames = frames.to(torch.get_default_dtype() if learned is None else learned.dtype)
        return frames if self.mask is None else frames * self.mask.to(frames)

    def _step(
        self, luminance: Tensor, state: LayerState | None, values: dict[str, Tensor]
    ) -> tuple[LayerResponse, LayerState]:
        if state is None:
            return self._start(luminance, values)
        pixels = luminance[0].numel() if self.mask is None else torch.count_nonzero(self.mask)

        photo = luminance - state.luminance  # eq. 1
        for order, past in enumerate(state.past_p.unbind(1), start=1):
            photo = photo + torch.sigmoid(-values["u"] * order) * past
        f = self._feed_forward(photo, state, values, pixels)
        w = torch.maximum(values["sigma_1"], f / values["t_f"])  # eq. 9
        s, paths, delayed = self._summation(photo, w, state, values)
        latency = self._latency(f, values)
        g = state.g + self._gain(latency)[:, None, None] * (self._grouping(s, values) - state.g)  # eq. 9
        k, k_hat = self._potentials(g.sum((1, 2)) / pixels, f, state, values)
        potential = k_hat if self.params.spikes_from == "adapted" else k
        spikes = self._spikes(torch.exp(values["sigma_4"] * (potential - values["t_sp"])))  # eq. 11
        past_p = torch.cat([photo[:, None], state.past_p], 1)[:, : self.params.n_p]
        window = torch.cat([state.window[:, 1:], spikes[:, None]], 1)
        after = LayerState(state.age + 1, luminance, past_p, paths, delayed, g, f, k, k_hat, window)
        return self._response(after, w, latency, values), after

    def _start(self, luminance: Tensor, values: dict[str, Tensor]) -> tuple[LayerResponse, LayerState]:
        """Return outputs and state after the first frame, which has no predecessor."""
        n, h, w = luminance.shape
        p, zeros = self.params, luminance.new_zeros
        k, none = values["k_0"].expand(n), zeros(n)
        state = LayerState(
            1, luminance, zeros(n, p.n_p, h, w), zeros(n, 2, h, w), zeros(3, n, 2, h, w), zeros(n, h, w),
            none, k, k, zeros(n, p.window),
        )  # fmt: skip
        return self._response(state, values["sigma_1"].expand(n), self._latency(none, values), values), state

    def _gain(self, tau: Tensor) -> Tensor:
        """Return the discrete gain of a first-order low-pass filter, dt / (dt + tau)."""
        dt = self.params.frame_interval_ms(self.fps)
        return dt / (dt + tau)

    def _is_warm(self, state: LayerState) -> bool:
        return self.params.warm_start and state.age == 1

    def _feed_forward(
        self, photo: Tensor, state: LayerState, values: dict[str, Tensor], pixels: Tensor | int
    ) -> Tensor:
        """Return F (eq. 2)."""
        f = photo.abs().sum((1, 2)) / pixels
        return f if self._is_warm(state) else state.f + self._gain(values["tau_1"]) * (f - state.f)

    def _latency(self, f: Tensor, values: dict[str, Tensor]) -> Tensor:
        """Return the time constant of G [ms] (eq. 9)."""
        fraction, lowest = 1.0 - f / values["t_f"], values["sigma_2"]
        if self.params.latency == "jump":
            return values["tau_g"] * torch.where(fraction >= 0.0, fraction, lowest)
        return values["tau_g"] * torch.maximum(lowest, fraction)

    def _summation(
        self, photo: Tensor, w: Tensor, state: LayerState, values: dict[str, Tensor]
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Return S, E of both paths and the memory of the delay (eq. 3 to 8).

        Delay and sum over neighbours are linear: each ring of neighbours is summed first, then delayed.
        """
        paths = torch.stack([photo, -photo], 1).clamp(min=0.0)
        if self.params.on_off_residue > 0.0 or "on_off_residue" in self.learned:
            paths = paths + values["on_off_residue"] * state.paths
        now = torch.stack(_rings(paths))
        gains = self._gain(values["tau_2"])
        delayed = now if self._is_warm(state) else torch.lerp(state.delayed, now, gains.view(3, 1, 1, 1, 1))
        inhibition = (values["weights"] @ delayed.view(3, -1)).view_as(paths)
        s_on, s_off = (paths - w[:, None, None, None] * inhibition).clamp(min=0.0).unbind(1)  # eq. 7
        s = values["theta_1"] * s_on + values["theta_2"] * s_off + values["theta_3"] * s_on * s_off  # eq. 8
        return s, paths, now if self.params.delay == "two-tap" else delayed

    def _grouping(self, s: Tensor, values: dict[str, Tensor]) -> Tensor:
        """Return g, the output of the grouping layer of Yue & Rind (2006)."""
        centre, nearest, diagonal = _rings(s[:, None])
        local = (centre + nearest + diagonal)[:, 0] / 9.0
        omega = values["delta_c"] + local.abs().amax((1, 2), keepdim=True) / values["c_w"]
        g = s * local / omega
        return g * self._switch(g * values["c_de"] - values["t_de"], "grouping")

    def _potentials(
        self, mean_g: Tensor, f: Tensor, state: LayerState, values: dict[str, Tensor]
    ) -> tuple[Tensor, Tensor]:
        """Return K and K after adaptation (eq. 10, SFA)."""
        k = torch.sigmoid(mean_g / values["sigma_3"])
        k = torch.lerp(torch.full_like(k, 0.5), k, self._switch(values["t_ffi"] - f, "silence", strict=True))
        rise = k - state.k
        keep = 1.0 / (1.0 + self.params.frame_interval_ms(self.fps) / values["tau_s"])
        adapts = self._switch(values["t_sfa"] - rise, "adaptation")
        adapted = keep * torch.lerp(k, state.k_hat + rise, adapts)
        return k, 0.5 + self._bounded(adapted - 0.5, (adapted - 0.5).clamp(min=0.0), "floor")

    def _switch(self, above: Tensor, width: str, *, strict: bool = False) -> Tensor:
        """Return 1 where a value is at or above 0 (above 0 if strict), 0 elsewhere; smooth with softness."""
        hard = (above > 0.0 if strict else above >= 0.0).to(above)
        if self.softness is None:
            return hard
        return self._soft_or_hard(torch.sigmoid(above / getattr(self.softness, width)), hard)

    def _bounded(self, value: Tensor, hard: Tensor, width: str) -> Tensor:
        """Return `hard`, or with softness a value with the smooth lower bound 0."""
        if self.softness is None:
            return hard
        size = getattr(self.softness, width)
        return self._soft_or_hard(size * functional.softplus(value / size), hard)

    def _soft_or_hard(self, soft: Tensor, hard: Tensor) -> Tensor:
        """Return smooth values, or hard ones with the gradients of the smooth ones."""
        surrogate = self.softness is not None and self.softness.surrogate
        return soft + (hard - soft).detach() if surrogate else soft

    def _spikes(self, drive: Tensor) -> Tensor:
        return self._bounded(drive - 0.5, drive.detach().floor(), "spikes")

    def _response(
        self, state: LayerState, w: Tensor, latency: Tensor, values: dict[str, Tensor]
    ) -> LayerResponse:
        """Return the outputs of a frame (eq. 12)."""
        p = self.params
        rate = 1000.0 / p.frame_interval_ms(self.fps) if p.whole_ms else self.fps
        frequency = state.window.sum(1) * rate / p.n_ts
        alert = frequency >= values["t_sf"]
        return LayerResponse(frequency, state.window[:, -1], state.k, state.k_hat, state.f, w, latency, alert)


def _rings(image: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Return the centre, the sum of the 4 nearest and of the 4 diagonal pixels of maps (N, C, H, W)."""
    padded = functional.pad(image, (1, 1, 1, 1), mode="replicate")
    sides, middle = padded[..., :-2, :] + padded[..., 2:, :], padded[..., 1:-1, :]
    nearest = sides[..., 1:-1] + middle[..., :-2] + middle[..., 2:]
    return image, nearest, sides[..., :-2] + sides[..., 2:]


def _scale(start: Tensor) -> Tensor:
    """Return the unit of a learned parameter: its start, or 1 where that is 0."""
    return torch.where(start == 0.0, 1.0, start.abs())


def _within_bounds(name: str, value: Tensor) -> Tensor:
    interval = LEARNABLE[name].interval
    assert interval is not None
    low = interval.low + (0.0 if interval.has_low else _OPEN_END)
    high = interval.high - (0.0 if interval.has_high or math.isinf(interval.high) else _OPEN_END)
    return value.clamp(low, high)


def _plain(value: Tensor) -> float | tuple[float, ...]:
    return tuple(float(x) for x in value) if value.ndim else float(value)


def _check_clips(frames: Tensor) -> None:
    if frames.ndim != 4 or 0 in frames.shape:
        raise ValueError(
            f"frames must have the shape (N, T, height, width), none of them 0, got {tuple(frames.shape)}"
        )
    if frames.is_floating_point():
        low, high = (float(bound) for bound in torch.aminmax(frames.detach()))
        if low != high and low >= 0.0 and high <= 1.0:
            raise ValueError(
                f"frames must be luminance in 0-255, got floats of {low:g} to {high:g}; use frames * 255"
            )

"""Registry of neuron models by name, and the adapter of models that are plain Python."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from threading import Lock
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lgmd_gym.aliases import Values
from lgmd_gym.errors import check_keys, check_known, check_text, shown
from lgmd_gym.neuron.base import FrameNeuron, Layer, Response, Signal
from lgmd_gym.neuron.lgmd.params import LGMDParams
from lgmd_gym.neuron.validation import Frames
from lgmd_gym.processes.user_modules import import_user_module


class Model(Protocol):
    """A model of one's own: `num` neurons, each with its own frames.

    It may also have these, each optional: `layers`, a mapping of names to maps of the last frame, arrays of
    shape (num, height, width), and `shown_layers`, a mapping of those names to `Layer`, for pictures;
    `column_map()`, which returns a map of the excitation, array of shape (num, height, width), and the mean
    at which the potential of a column is 0.73; `shift(active, turns_px)`, which moves its state to the left
    by whole pixels, int64, shape (num,), before the step of a derotated camera. A model that has `step_range`
    is a subclass of `FrameNeuron` and is used as it is.

    Attributes:
        signals: Its outputs among the fields of `Response`, with bounds and units. The others are 0, but
            `alert` is whether `spike_frequency` is at least t_sf.
    """

    signals: Mapping[str, Signal]

    def step(self, frames: Frames, active: NDArray[np.bool_]) -> Mapping[str, ArrayLike]:
        """Process one frame per active neuron; the others keep their state, and their outputs are ignored.

        Args:
            frames: Grey luminance, shape (num, height, width), row 0 at the top; not to be changed or kept.
            active: Selection of the neurons, shape (num,).

        Returns:
            The outputs by the names in `signals`, arrays of shape (num,), finite.
        """
        ...

    def reset(self, mask: NDArray[np.bool_]) -> None:
        """Return selected neurons, shape (num,), to the state before the first frame."""
        ...


@dataclass(frozen=True, slots=True)
class _Registered:
    factory: Callable[..., object]
    takes_params: bool


_MODELS: dict[str, _Registered] = {}


def register(name: str, factory: Callable[..., object], *, takes_params: bool = False) -> None:
    """Register a neuron model, which cameras then use by its name.

    Args:
        name: Name of the model.
        factory: Function or class that is called with (shape, fps, num): (height, width) of the frames [px],
            frame rate [Hz] and number of neurons; it returns a `Model` or a `FrameNeuron`.
        takes_params: Whether it also takes a fourth argument, the `LGMDParams` in use.

    Raises:
        ValueError: If the name is empty or taken, or the factory cannot be called.

    Example:
        >>> class Change:
        ...     signals = {"spike_frequency": Signal(0.0, 255.0, "spikes/s")}
        ...
        ...     def __init__(self, shape, fps, num):
        ...         self.last = np.zeros((num, *shape))
        ...
        ...     def step(self, frames, active):
        ...         change = np.abs(frames - self.last).mean((1, 2))
        ...         self.last[active] = frames[active]
        ...         return {"spike_frequency": change}
        ...
        ...     def reset(self, mask):
        ...         self.last[mask] = 0.0
        >>> register("mean-change", Change)
        >>> float(make("mean-change", (4, 8), fps=30.0).step(np.full((4, 8), 9, np.uint8)).spike_frequency)
        9.0
    """
    if not check_text("name", name):
        raise ValueError("the name of a neuron model must not be empty")
    if name in _MODELS:
        raise ValueError(f"the neuron model {name!r} is registered already; choose another name")
    if not callable(factory):
        raise ValueError(f"factory must be a function or class, got {shown(factory)}")
    _MODELS[name] = _Registered(factory=factory, takes_params=takes_params)


def names() -> tuple[str, ...]:
    """Return the names of the registered models."""
    return tuple(_MODELS)


def check_model(field: str, name: str) -> str:
    """Return the name of a registered model, or of one that is imported and registered: MODULE:FACTORY.

    Args:
        field: Name of the argument, for the message.
        name: The name.

    Raises:
        ValueError: For another name, with the nearest registered one, or a module that cannot be imported.
    """
    module, colon, factory = check_text(field, name).partition(":")
    if colon and name not in _MODELS:
        found: object = getattr(import_user_module(module, f"{field} {name!r}"), factory, None)
        if not callable(found):
            raise ValueError(f"{field} {name!r} cannot be imported: {module} has no function {factory}")
        register(name, found)
    return check_known(field, name, _MODELS)


def make(
    name: str,
    shape: tuple[int, int],
    fps: float = 30.0,
    num: int | None = None,
    params: LGMDParams | None = None,
    *,
    columns: int = 0,
    derotated: bool = False,
) -> FrameNeuron:
    """Return neurons of a registered model.

    Args:
        name: Name of the model.
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        num: Number of neurons; None for a single one with scalar outputs.
        params: Parameters of the LGMD, of which other models may use those of the spikes; None for the
            defaults.
        columns: Number of columns that will be read; 0 for none.
        derotated: Whether the state will be shifted, see `FrameNeuron.step`.

    Raises:
        ValueError: For an unknown name, or a model without columns or shift where they are needed.
    """
    registered = _MODELS[check_model("neuron", name)]
    params = LGMDParams() if params is None else params
    further = (params,) if registered.takes_params else ()
    model = registered.factory(shape, fps, 1 if num is None else num, *further)
    if not isinstance(model, FrameNeuron):
        model = _Adapter(name, cast(Model, model), shape, fps, num, params)
    if columns:
        model.column_map()  # raises ValueError for a model without columns
    if derotated and isinstance(model, _Adapter) and not hasattr(model.model, "shift"):
        raise ValueError(f"neuron {name!r} must have shift(active, turns_px) for a derotated camera")
    if num is None:
        model.make_single()
    return model


class _Adapter(FrameNeuron):
    """Neurons of a `Model`, as a `FrameNeuron`; its steps take turns, whichever thread calls them."""

    def __init__(
        self,
        name: str,
        model: Model,
        shape: tuple[int, int],
        fps: float,
        num: int | None,
        params: LGMDParams,
    ) -> None:
        super().__init__(shape, fps, 1 if num is None else num, None)
        self.model, self._name, self._alert_level = model, name, params.t_sf
        for method in ("step", "reset"):
            if not callable(getattr(model, method, None)):
                raise ValueError(f"neuron {name!r} must have a method {method}, got {shown(model)}")
        self._columns = {key: Response._fields.index(key) for key in self._declared()}
        self._initial = np.zeros(len(Response._fields))
        for key, index in self._columns.items():
            signal = model.signals[key]
            self._initial[index] = min(max(0.0, signal.low), signal.high)
        self._scalars = np.tile(self._initial, (self._count, 1))
        self._maps = ()
        self._lock = Lock()

    @property
    def signals(self) -> dict[str, Signal]:
        """Bounds and units of the outputs; an output that the model does not have is 0."""
        return {key: self.model.signals.get(key, Signal(low=0.0, high=1.0)) for key in Response._fields}

    @property
    def shown_layers(self) -> Mapping[str, Layer]:
        """The layers in pictures; see `Model`."""
        return getattr(self.model, "shown_layers", {})

    @property
    def layers(self) -> dict[str, NDArray[np.float32]]:
        """Maps of the last frame by name; see `Model`."""
        maps: Mapping[str, ArrayLike] = getattr(self.model, "layers", {})
        arrays = {name: np.array(values, np.float32) for name, values in maps.items()}
        return {name: values[0] for name, values in arrays.items()} if self.num is None else arrays

    def step_range(self, first: int, last: int, frames: Frames, active: NDArray[np.bool_]) -> None:
        """Step the active neurons among first..last-1; see `FrameNeuron.step_range`."""
        selected = self._among(first, last, active)
        if not selected.any():
            return
        with self._lock:
            outputs = self.model.step(frames, selected)
            check_keys(f"signal of neuron {self._name!r}", outputs, self._columns)
            for key, index in self._columns.items():
                self._scalars[selected, index] = self._checked(key, outputs[key], selected)
        if "alert" not in self._columns:
            frequency, alert = (Response._fields.index(key) for key in ("spike_frequency", "alert"))
            self._scalars[selected, alert] = self._scalars[selected, frequency] >= self._alert_level

    def shift_range(
        self,
        first: int,
        last: int,
        frames: Frames,
        active: NDArray[np.bool_],
        turns_px: NDArray[np.int64],
    ) -> None:
        """Shift the state of active neurons among first..last-1; see `FrameNeuron.shift_range`."""
        with self._lock:
            cast(Any, self.model).shift(self._among(first, last, active), turns_px)

    def column_map(self) -> tuple[NDArray[np.float32], float]:
        """Return the map of the columns; see `FrameNeuron.column_map`."""
        if not hasattr(self.model, "column_map"):
            raise ValueError(f"neuron {self._name!r} has no columns: it has no column_map()")
        values, sigma = cast(Any, self.model).column_map()
        return np.asarray(values, np.float32), float(sigma)

    def reset(self, mask: ArrayLike | None = None) -> None:
        """Return to the state before the first frame; see `FrameNeuron.reset`."""
        super().reset(mask)
        with self._lock:
            self.model.reset(self._all_active if mask is None else np.asarray(mask))

    def _among(self, first: int, last: int, active: NDArray[np.bool_]) -> NDArray[np.bool_]:
        selected = np.zeros(self._count, np.bool_)
        selected[first:last] = active[first:last]
        return selected

    def _declared(self) -> Mapping[str, Signal]:
        """Return the signals of the model.

        Raises:
            ValueError: If there are none, one has another name than an output, or its bounds are wrong.
        """
        given: object = getattr(self.model, "signals", None)
        if not isinstance(given, Mapping) or not given:
            raise ValueError(f"neuron {self._name!r} must have signals, a mapping of names to Signal")
        signals = cast(Mapping[str, object], given)
        check_keys(f"signal of neuron {self._name!r}", signals, Response._fields)
        for key, signal in signals.items():
            if not isinstance(signal, Signal) or not signal.low <= signal.high:
                raise ValueError(
                    f"signal {key!r} of neuron {self._name!r} must be Signal(low, high) with low <= high, "
                    f"got {shown(signal)}"
                )
        return cast(Mapping[str, Signal], signals)

    def _checked(self, key: str, values: ArrayLike, selected: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return an output of the selected neurons within its bounds; `values` have the shape (num,)."""
        array = np.asarray(values, np.float64)
        if array.shape != (self._count,):
            raise ValueError(
                f"signal {key!r} of neuron {self._name!r} must have the shape ({self._count},), got "
                f"{array.shape}"
            )
        array, signal = array[selected], self.model.signals[key]
        inside = (array >= signal.low) & (array <= signal.high)  # False for NaN
        if not inside.all():
            raise ValueError(
                f"signal {key!r} of neuron {self._name!r} must be in [{signal.low:g}, {signal.high:g}], got "
                f"{array[~inside][0]:g}"
            )
        return array

    def __getstate__(self) -> Values:
        return self.__dict__ | {"_lock": None}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self._lock = Lock()

"""Registry of neuron models by name, and the adapter of models that are plain Python."""

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from threading import Lock
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lgmd_gym.aliases import Arguments, Values
from lgmd_gym.errors import check_keys, check_known, check_text, shown, unknown_name
from lgmd_gym.fields import parse_options
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
    options: tuple[str, ...] | None  # None for any
    about: str


_MODELS: dict[str, _Registered] = {}


def register(
    name: str,
    factory: Callable[..., object],
    *,
    takes_params: bool = False,
    options: Iterable[str] | None = None,
    about: str | None = None,
) -> None:
    """Register a neuron model, which cameras then use by its name.

    Args:
        name: Name of the model.
        factory: Function or class that is called with (shape, fps, num): (height, width) of the frames [px],
            frame rate [Hz] and number of neurons; it returns a `Model` or a `FrameNeuron`. Options of a
            specification such as "mine:gain=2" become keyword arguments.
        takes_params: Whether it also takes a fourth argument, the `LGMDParams` in use.
        options: Names of the options; None for the further arguments of the factory.
        about: Description in one line; None for the first line of the factory's docstring.

    Raises:
        ValueError: If the name is empty, taken or contains a colon, or the factory cannot be called.

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
    if ":" in name:
        raise ValueError(f"the name of a neuron model must not contain a colon, got {shown(name)}")
    if name in _MODELS:
        raise ValueError(f"the neuron model {name!r} is registered already; choose another name")
    if not callable(factory):
        raise ValueError(f"factory must be a function or class, got {shown(factory)}")
    known = _further_arguments(factory, 3 + takes_params) if options is None else tuple(options)
    lines = (inspect.getdoc(factory) or "").splitlines()
    _MODELS[name] = _Registered(factory, takes_params, known, about or (lines[0] if lines else ""))


def _further_arguments(factory: Callable[..., object], count: int) -> tuple[str, ...] | None:
    """Return the names of the arguments of a factory after the first `count`; None for any name."""
    try:
        arguments = list(inspect.signature(factory).parameters.values())
    except (TypeError, ValueError):  # compiled code without a signature
        return None
    kinds = inspect.Parameter
    if any(item.kind is kinds.VAR_KEYWORD for item in arguments):
        return None
    positional = [
        item for item in arguments if item.kind in (kinds.POSITIONAL_ONLY, kinds.POSITIONAL_OR_KEYWORD)
    ]
    named = [*positional[count:], *(item for item in arguments if item.kind is kinds.KEYWORD_ONLY)]
    return tuple(item.name for item in named)


def names() -> tuple[str, ...]:
    """Return the names of the registered models, presets of the LGMD included."""
    return tuple(_MODELS)


def outside_code(text: str) -> str | None:
    """Return what a specification would import from outside this package; None for nothing.

    Example:
        >>> outside_code("my_module:Mine:gain=2")
        "module 'my_module'"
    """
    name, colon, rest = text.partition(":")
    known = not colon or name in _MODELS or f"{name}:{rest.partition(':')[0]}" in _MODELS
    return None if known else f"module {name!r}"


def base_name(text: str) -> str:
    """Return the registered name in a specification, without its options; see `check_model`."""
    return _parse("neuron", text)[0]


def describe(name: str) -> tuple[str, tuple[str, ...] | None]:
    """Return the description of a registered model in one line, and its options; None for any.

    Raises:
        ValueError: For an unknown name, with the nearest registered one.
    """
    registered = _MODELS[check_known("neuron", name, _MODELS)]
    return registered.about, registered.options


def check_model(field: str, name: str) -> str:
    """Return the specification of a model after a check of its names.

    Args:
        field: Name of the argument, for the message.
        name: "NAME[:OPTION=VALUE,…]" for a registered model, as in "off-only:t_sp=0.78", or
            "MODULE:FACTORY[:OPTION=VALUE,…]" for one of a module, which is imported and registered.

    Raises:
        ValueError: For an unknown model or option, with the nearest known one, or a module that cannot be
            imported.
    """
    _parse(field, name)
    return name


def _parse(field: str, text: str) -> tuple[str, Arguments]:
    """Return the registered name and the options of a specification; see `check_model`."""
    name, colon, rest = check_text(field, text).partition(":")
    if colon and name not in _MODELS:
        factory, _, rest = rest.partition(":")
        if "=" in factory:
            raise unknown_name(field, name, _MODELS)
        module, name = name, f"{name}:{factory}"
        if name not in _MODELS:
            _MODELS[name] = _imported(module, factory, f"{field} {name!r}")
    check_known(field, name, _MODELS, "a model of your own is MODULE:FACTORY")
    options = {
        key: {"true": True, "false": False}.get(str(value), value)
        for key, value in parse_options(field, rest, text).items()
    }
    known = _MODELS[name].options
    if known is not None:
        check_keys(f"option of {field} {name!r}", options, known)
    return name, options


def import_models(text: str) -> None:
    """Import a module that registers models, or register one as MODULE:FACTORY.

    Args:
        text: "MODULE", or "MODULE:FACTORY".

    Raises:
        ValueError: If the module cannot be imported or has no such factory.
    """
    if ":" in text:
        check_model("neuron", text)
    else:
        import_user_module(text, f"module {text!r}")


def _imported(module: str, factory: str, kind: str) -> _Registered:
    """Return the factory of a module of the user."""
    found: object = getattr(import_user_module(module, kind), factory, None)
    if not callable(found):
        raise ValueError(f"{kind} cannot be imported: {module} has no function {factory}")
    lines = (inspect.getdoc(found) or "").splitlines()
    return _Registered(found, False, _further_arguments(found, 3), lines[0] if lines else "")


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
        name: Name of the model, with options as in "off-only:t_sp=0.78"; see `check_model`.
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        num: Number of neurons; None for a single one with scalar outputs.
        params: Parameters of the LGMD, of which other models may use those of the spikes; None for the
            defaults.
        columns: Number of columns that will be read; 0 for none.
        derotated: Whether the state will be shifted, see `FrameNeuron.step`.

    Raises:
        ValueError: For an unknown name or option, or a model without columns or shift where they are needed.

    Example:
        >>> make("lgmd:t_sp=0.78", (4, 8)).params == make("lgmd", (4, 8), params=LGMDParams(t_sp=0.78)).params
        True
    """
    key, options = _parse("neuron", name)
    registered = _MODELS[key]
    params = LGMDParams() if params is None else params
    further = (params,) if registered.takes_params else ()
    model = registered.factory(shape, fps, 1 if num is None else num, *further, **options)
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

# pyright: standard
# Not strict: the types of the unpickler in Python, `pickle._Unpickler`, are not documented.
"""Weights in a model file of stable-baselines3, as arrays, without PyTorch.

PyTorch stores them as a zip file in the zip file of the model: a pickle with names, shapes and strides, and a
member of bytes for each tensor. The unpickler has the few operations that this requires, and calls no code
that a file names.
"""

import io
import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym.errors import shown
from lgmd_gym.processes.inputs import check_members

WEIGHTS = "policy.pth"  # member of every model file of stable-baselines3
MAX_BYTES = 1_000_000_000  # of the unpacked weights
MAX_PICKLE = 1_000_000  # bytes of the names and shapes; those of `all-round` take 2,500
_PICKLE, _ORDER = "/data.pkl", "/byteorder"  # ends of the names of members
_DTYPES = {b"little": np.dtype("<f4"), b"big": np.dtype(">f4")}
_OPERATIONS = b"".join((
    pickle.PROTO, pickle.STOP, pickle.GLOBAL, pickle.BINPERSID, pickle.MARK,
    pickle.BINPUT, pickle.LONG_BINPUT, pickle.BINGET, pickle.LONG_BINGET,
    pickle.BINUNICODE, pickle.BININT, pickle.BININT1, pickle.BININT2, pickle.LONG1,
    pickle.NONE, pickle.NEWTRUE, pickle.NEWFALSE,
    pickle.EMPTY_TUPLE, pickle.TUPLE, pickle.TUPLE1, pickle.TUPLE2, pickle.TUPLE3,
    pickle.SETITEM, pickle.SETITEMS,
))  # fmt: skip


class _OtherFormatError(Exception):
    """The weights are not float32, or contain other objects of PyTorch than tensors."""


class _Items(dict[str, Any]):
    """Items by name. Other keys are refused: the hash of nested tuples can take for ever."""

    def __setitem__(self, key: object, value: object) -> None:
        if type(key) is not str:
            raise ValueError("its weights must have names")
        super().__setitem__(key, value)


def weights_file(path: Path) -> io.BytesIO:
    """Return the weights in a model file, as PyTorch wrote them.

    Raises:
        ValueError: If they unpack to more than `MAX_BYTES`. Errors of zipfile pass through.
    """
    with zipfile.ZipFile(path) as file:
        check_members(file, MAX_BYTES)
        data = io.BytesIO(file.read(WEIGHTS))
    if zipfile.is_zipfile(data):
        with zipfile.ZipFile(data) as inside:
            check_members(inside, MAX_BYTES)
    data.seek(0)
    return data


def read_weights(path: Path) -> dict[str, np.ndarray] | None:
    """Return the weights in a model file by name; no code of the file is executed.

    Returns:
        Arrays of float32 in the byte order of the file, which cannot be written; None for weights of another
        format, which PyTorch may be able to read.

    Raises:
        ValueError: If the weights are damaged, or contain something else. Errors of zipfile pass through.
    """
    data = weights_file(path)
    if not zipfile.is_zipfile(data):
        return None
    with zipfile.ZipFile(data) as archive:
        try:
            weights: object = _Unpickler(archive).load()
        except _OtherFormatError:
            return None
        except ValueError:
            raise
        except Exception:  # of an operation on other values than it expects
            raise ValueError("its weights are damaged") from None
    if type(weights) is not _Items or not all(isinstance(item, np.ndarray) for item in weights.values()):
        raise ValueError("its weights are not tensors by name")
    return dict(weights)


def _push_items(unpickler: Any) -> None:
    unpickler.append(_Items())


def _drop_state(unpickler: Any) -> None:
    unpickler.stack.pop()  # version numbers of layers; the operation of `pickle` sets any attribute


def _call(unpickler: Any) -> None:
    arguments = unpickler.stack.pop()
    if type(arguments) is not tuple:  # the items of a tensor would be one Python object each
        raise ValueError("its weights are damaged")
    unpickler.stack[-1] = unpickler.stack[-1](*arguments)


class _Unpickler(pickle._Unpickler):
    """Unpickler of tensors by name.

    Args:
        archive: Zip file of PyTorch.

    Raises:
        ValueError: If it has not exactly one pickle, or too large a one.
    """

    def __init__(self, archive: zipfile.ZipFile) -> None:
        names = archive.namelist()
        pickles = [name for name in names if name.endswith(_PICKLE)]
        if len(pickles) != 1 or archive.getinfo(pickles[0]).file_size > MAX_PICKLE:
            raise ValueError(f"its weights must have one {_PICKLE[1:]} of at most {MAX_PICKLE} bytes")
        self._archive, self._folder = archive, pickles[0].removesuffix(_PICKLE)
        order = f"{self._folder}{_ORDER}"  # files of PyTorch before 2.1 have none
        self._dtype = _DTYPES[archive.read(order) if order in names else b"little"]
        self._storages: dict[str, np.ndarray] = {}
        super().__init__(io.BytesIO(archive.read(pickles[0])))

    def find_class(self, module: str, name: str) -> Any:
        """Return a function of this module in place of the named one."""
        known = {
            "collections.OrderedDict": _no_items,
            "torch._utils._rebuild_tensor_v2": _view,
            "torch.FloatStorage": "float",
        }
        found = known.get(f"{module}.{name}")
        if found is None and module.partition(".")[0] == "torch":
            raise _OtherFormatError
        if found is None:
            raise ValueError(f"its weights must not contain {shown(f'{module}.{name}')}")
        return found

    def persistent_load(self, pid: Any) -> np.ndarray:
        """Return the values of a storage, float32, shape (count,)."""
        kind, dtype, key, _, count = pid
        # Exact types: a comparison with a tensor takes the memory of one, however large its shape is.
        if not (type(kind) is type(dtype) is type(key) is str and type(count) is int):
            raise ValueError("its weights must be in storages")
        if kind != "storage" or dtype != "float":
            raise ValueError("its weights must be in storages")
        if key not in self._storages:  # read once, however often it is named
            self._storages[key] = np.frombuffer(self._archive.read(f"{self._folder}/data/{key}"), self._dtype)
        if len(self._storages[key]) != count:
            raise ValueError(f"storage {shown(key)} must have {count} values")
        return self._storages[key]

    dispatch = {code: pickle._Unpickler.dispatch[code] for code in _OPERATIONS} | {
        pickle.EMPTY_DICT[0]: _push_items,
        pickle.BUILD[0]: _drop_state,
        pickle.REDUCE[0]: _call,
    }


def _no_items() -> _Items:
    return _Items()


def _view(storage: Any, offset: Any, size: Any, stride: Any, *_: object) -> np.ndarray:
    """Return a tensor as a view of the values of its storage.

    Raises:
        ValueError: Unless all of it is within the storage.
    """
    if type(size) is not tuple or type(stride) is not tuple:
        raise ValueError("the shapes of its weights are damaged")
    numbers = (offset, *size, *stride)
    if not all(type(number) is int and number >= 0 for number in numbers) or len(size) != len(stride):
        raise ValueError("the shapes of its weights are damaged")
    last = offset + sum((count - 1) * step for count, step in zip(size, stride, strict=True))
    if 0 in size or last >= storage.size:
        raise ValueError("its weights are outside of their storage")
    steps = [storage.itemsize * step for step in stride]
    return np.ndarray(size, storage.dtype, storage, storage.itemsize * offset, steps)

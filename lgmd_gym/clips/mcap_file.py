"""MCAP files of processed clips: frames, layers and signals of the neuron, each with its time stamp.

Viewers such as Foxglove and Lichtblick play these files. The messages are JSON. `/frame` (JPEG) and
`/layer/P`, `/layer/E`, `/layer/I`, `/layer/S`, `/layer/G` (8-bit PNG, lossless, of the absolute value rounded
and limited to 255) have the schema foxglove.CompressedImage; `/neuron` has the signals of trace.csv; `/event`
has a foxglove.Log for each alarm that begins after 1/3 s without alarm, and one for the crash or event.
"""

import base64
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from lgmd_gym._version import __version__
from lgmd_gym.clips.playback import TRACE_COLUMNS, ClipFrame
from lgmd_gym.neuron import LGMD
from lgmd_gym.processes.extras import missing_extra
from lgmd_gym.processes.files import check_new_file

LAYERS = ("P", "E", "I", "S", "G")
JPEG_QUALITY = 85
WARNING = 3  # level of a foxglove.Log
_TIME = {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}}
_TEXT, _NUMBER = {"type": "string"}, {"type": "number"}
_IMAGE = {"timestamp": _TIME, "frame_id": _TEXT, "format": _TEXT,
          "data": {"type": "string", "contentEncoding": "base64"}}  # fmt: skip
_LOG = {"timestamp": _TIME, "level": {"type": "integer"}, "message": _TEXT, "name": _TEXT}
_RESPONSE = {"timestamp": _TIME, **dict.fromkeys(TRACE_COLUMNS, _NUMBER)}


def check_mcap() -> None:
    """Raise ValueError if the package mcap is not installed."""
    try:
        import mcap  # noqa: F401
    except ImportError:
        raise missing_extra("--mcap", "mcap") from None


class McapWriter:
    """Write an MCAP file of a clip; use it in a `with` block.

    Args:
        path: File, which must not exist.
        title: Name of the clip, the `frame_id` of the images.
        crash_s: Time of the crash [s]; None for none.
    """

    def __init__(self, path: Path, title: str, crash_s: float | None) -> None:
        from mcap.writer import Writer

        check_new_file(path, "MCAP file")
        self.title, self.crash_s = title, crash_s
        self._writer = Writer(str(path))
        self._writer.start(library=f"lgmd-gym {__version__}")
        image = self._schema("foxglove.CompressedImage", _IMAGE)
        topics = {"/frame": image, **{f"/layer/{name}": image for name in LAYERS}}
        topics["/neuron"] = self._schema("lgmd_gym.Response", _RESPONSE)
        topics["/event"] = self._schema("foxglove.Log", _LOG)
        self._channels = {
            topic: self._writer.register_channel(topic, "json", schema) for topic, schema in topics.items()
        }

    def write(self, frame: ClipFrame, neuron: LGMD) -> None:
        """Append the messages of one frame."""
        self._image("/frame", frame.time, frame.picture, "jpeg", quality=JPEG_QUALITY)
        for name, layer in neuron.layers.items():
            pixels = np.minimum(np.rint(np.abs(layer)), 255.0).astype(np.uint8)
            self._image(f"/layer/{name}", frame.time, pixels, "png", compress_level=1)
        row: dict[str, float] = {
            name: float(value) for name, value in zip(TRACE_COLUMNS, frame.row(), strict=True)
        }
        self._message("/neuron", frame.time, row)
        if frame.onset:
            self._log(frame.time, "alarm begins")
        if self.crash_s is not None and frame.time >= self.crash_s - 1e-6:
            self._log(frame.time, f"crash at {self.crash_s:.2f} s")
            self.crash_s = None

    def __enter__(self) -> "McapWriter":
        return self

    def __exit__(self, *_: Any) -> None:
        self._writer.finish()

    def _schema(self, name: str, properties: dict[str, Any]) -> int:
        text = json.dumps({"title": name, "type": "object", "properties": properties})
        return self._writer.register_schema(name, "jsonschema", text.encode())

    def _image(self, topic: str, time: float, pixels: np.ndarray, kind: str, **options: int) -> None:
        file = io.BytesIO()
        Image.fromarray(pixels).save(file, kind, **options)
        data = base64.b64encode(file.getvalue()).decode("ascii")
        self._message(topic, time, {"frame_id": self.title, "format": kind, "data": data})

    def _log(self, time: float, text: str) -> None:
        self._message("/event", time, {"level": WARNING, "name": self.title, "message": text})

    def _message(self, topic: str, time: float, fields: dict[str, Any]) -> None:
        stamp = round(time * 1e9)
        seconds, nanoseconds = divmod(stamp, 1_000_000_000)
        data = json.dumps({"timestamp": {"sec": seconds, "nsec": nanoseconds}, **fields}).encode()
        self._writer.add_message(self._channels[topic], stamp, data, stamp)

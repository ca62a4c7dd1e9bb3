"""Tests of `lgmd-gym video --mcap`: the file is read back."""

import base64
import csv
import io
import json
import sys

import numpy as np
from mcap.reader import make_reader
from PIL import Image

from lgmd_gym.cli import main as cli
from lgmd_gym.clips.playback import ClipRun, PlaybackConfig
from lgmd_gym.processes.extras import install_command


def read_messages(path):
    """Return the (time [ns], fields) of each topic, in the order of time."""
    topics = {}
    with path.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            topics.setdefault(channel.topic, []).append((message.log_time, json.loads(message.data)))
    return topics


def decoded(fields):
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(fields["data"]))))


def test_the_file_has_every_frame_layer_and_signal(tmp_path, clip):
    assert cli.run(["video", str(clip), "--crash-frame", "42", "--mcap", "--no-plots",
                    "--out", str(tmp_path / "run")]) == 0  # fmt: skip
    topics = read_messages(tmp_path / "run" / "loom" / "clip.mcap")
    run = ClipRun(clip, PlaybackConfig())
    layers = [{name: layer.copy() for name, layer in run.neuron.layers.items()} for _ in run]
    with (tmp_path / "run" / "loom" / "trace.csv").open(newline="") as file:
        trace = list(csv.DictReader(file))
    times = [round(number / 30.0 * 1e9) for number in range(60)]
    assert set(topics) == {"/frame", "/neuron", "/event", *(f"/layer/{name}" for name in "PEISG")}
    for name in "PEISG":
        assert [time for time, _ in topics[f"/layer/{name}"]] == times
        for (_, fields), expected in zip(topics[f"/layer/{name}"], layers, strict=True):
            pixels = np.minimum(np.rint(np.abs(expected[name])), 255)
            np.testing.assert_array_equal(decoded(fields), pixels)
    assert max(expected["G"].max() for expected in layers) > 1
    for (_, fields), row in zip(topics["/neuron"], trace, strict=True):
        assert {name: float(value) for name, value in row.items()} == {
            name: value for name, value in fields.items() if name != "timestamp"
        }
    for (time, fields), frame in zip(topics["/frame"], ClipRun(clip, PlaybackConfig()), strict=True):
        assert fields["timestamp"] == {"sec": time // 10**9, "nsec": time % 10**9}
        assert np.abs(decoded(fields).astype(float) - frame.picture).mean() < 4
    logged = [(time, fields["message"]) for time, fields in topics["/event"]]
    onsets = [(times[int(row["frame"])], "alarm begins") for row in trace if row["onset"] == "1"]
    assert onsets
    assert sorted(logged) == sorted([*onsets, (times[42], "crash at 1.40 s")])


def test_a_missing_package_is_one_line(clip, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "mcap", None)
    assert cli.run(["video", str(clip), "--mcap", "--out", str(tmp_path / "run")]) == 2
    assert (
        capsys.readouterr().err == f'lgmd-gym: --mcap requires the extra "mcap": {install_command("mcap")}\n'
    )
    assert not (tmp_path / "run").exists()

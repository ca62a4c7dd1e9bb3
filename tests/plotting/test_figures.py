"""Figures of `lgmd_gym.plotting`: data, labels and limits of the axes, and the saved file."""

import io

import numpy as np
import pytest

from lgmd_gym import LGMD
from lgmd_gym.plotting.figures import contact_sheet, episode_figure, layers_figure
from lgmd_gym.plotting.style import saved_figure

SHAPE = (40, 60)


def braking_series(final_gap):
    """Time series of 50 decisions that end at a gap [m]."""
    return {
        "time": np.arange(50) / 30,
        "ego_speed": np.linspace(10, 0, 50),
        "gap": np.linspace(20, final_gap, 50),
        "spike_frequency": np.linspace(0, 100, 50),
    }


def test_episode_figure_plots_frequency_speed_and_gap_of_every_agent(tmp_path):
    series = {"first": braking_series(0.0), "second": braking_series(3.0)}
    figure = episode_figure(tmp_path / "case.png", "a case", series, alert_level=30.0)
    frequency, speed, gap = figure.axes
    assert figure.get_suptitle() == "a case"
    assert [axis.get_ylabel() for axis in figure.axes] == [
        "spike frequency\n[spikes/s]",
        "ego speed [km/h]",
        "gap [m]",
    ]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["first", "second"]
    np.testing.assert_array_equal(frequency.lines[1].get_ydata(), series["second"]["spike_frequency"])
    assert frequency.lines[2].get_ydata() == [30.0, 30.0]
    # Each agent adds a line and the marker of its end.
    assert speed.lines[0].get_ydata()[0] == pytest.approx(36.0)
    assert [gap.lines[index].get_marker() for index in (1, 3)] == ["x", "o"]
    assert gap.lines[2].get_color() == speed.lines[2].get_color() != gap.lines[0].get_color()
    assert all(axis.get_ylim()[0] == 0 for axis in figure.axes)


@pytest.mark.parametrize("undefined", [np.nan, np.inf])
def test_episode_figure_states_that_the_path_is_free(tmp_path, undefined):
    series = braking_series(3.0) | {"gap": np.full(50, undefined)}
    figure = episode_figure(tmp_path / "case.png", "empty road", {"agent": series}, 30.0)
    assert [text.get_text() for text in figure.axes[2].texts] == ["no vehicle in the ego's path"]
    occupied = episode_figure(tmp_path / "case.png", "a case", {"agent": braking_series(3.0)}, 30.0)
    assert not occupied.axes[2].texts


def test_layers_figure_shows_the_layers_of_the_neuron(tmp_path):
    frames = np.random.default_rng(0).integers(0, 255, (3, *SHAPE), np.uint8)
    neuron = LGMD(SHAPE)
    for frame in frames:
        neuron.step(frame)
    figure = layers_figure(tmp_path / "layers.png", neuron, frames[-1])
    images = {axis.get_title().split(":")[0]: axis.images[0] for axis in figure.axes if axis.get_title()}
    assert list(images) == ["L", "P", "E", "I", "S", "G"]
    np.testing.assert_array_equal(images["L"].get_array(), frames[-1])
    for name, values in neuron.layers.items():
        if name in images:
            np.testing.assert_array_equal(images[name].get_array(), values)
    low, high = images["P"].get_clim()
    assert low == -high == -np.abs(neuron.layers["P"]).max()
    without_frame = layers_figure(tmp_path / "layers.png", neuron)
    assert without_frame.axes[0].get_title().startswith("P")


def test_layers_figure_rejects_a_batch(tmp_path):
    with pytest.raises(ValueError, match="must be a single neuron, got a batch of 2"):
        layers_figure(tmp_path / "layers.png", LGMD(SHAPE, num=2))


def test_contact_sheet_arranges_frames_by_row_and_column(tmp_path):
    grey = {value: np.full(SHAPE, value, np.uint8) for value in (10, 20, 30)}
    figure = contact_sheet(
        tmp_path / "sheet.png", {"day": {"wide": grey[10], "tele": grey[20]}, "night": {"tele": grey[30]}}
    )
    shown = [int(axis.images[0].get_array().max()) if axis.images else None for axis in figure.axes]
    assert shown == [10, 20, None, 30]
    assert [axis.get_title() for axis in figure.axes[:2]] == ["wide", "tele"]
    assert [figure.axes[index].get_ylabel() for index in (0, 2)] == ["day", "night"]
    with pytest.raises(ValueError, match="at least one frame"):
        contact_sheet(tmp_path / "empty.png", {"day": {}})


@pytest.mark.parametrize(
    ("name", "signature"), [("a.png", b"\x89PNG"), ("a.svg", b"<?xml"), ("a", b"\x89PNG")]
)
def test_saved_figure_uses_the_format_of_the_suffix(tmp_path, name, signature):
    with saved_figure(tmp_path / name, 1, 1):
        pass
    assert (tmp_path / name).read_bytes().startswith(signature)


def test_saved_figure_writes_svg_to_an_open_file():
    file = io.BytesIO()
    with saved_figure(file, 1, 1):
        pass
    assert file.getvalue().startswith(b"<?xml")


def test_saved_figure_closes_the_figure_and_restores_the_style(tmp_path):
    import matplotlib as mpl
    from matplotlib import pyplot

    font_size = mpl.rcParams["font.size"]
    with pytest.raises(RuntimeError), saved_figure(tmp_path / "a.png", 1, 1):
        raise RuntimeError
    assert pyplot.get_fignums() == []
    assert mpl.rcParams["font.size"] == font_size
    assert not (tmp_path / "a.png").exists()

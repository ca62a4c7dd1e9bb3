"""The exported C source: it compiles without a warning, and its traces are those of the float64 reference."""

import io
import os
import shutil
import subprocess

import numpy as np
import pytest
from golden.sequences import grating, looming, natural, random

from lgmd_gym.cli import main as cli
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.neuron.export_c import FILES, c_sources, export_c
from lgmd_gym.neuron.lgmd.reference import ReferenceLGMD

COMPILER = shutil.which(os.environ.get("CC", "cc"))
SHAPE = (72, 99)
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O2")
COLUMNS = ("spike_frequency", "spikes", "membrane_potential", "adapted_potential", "ffi", "inhibition_weight")
PARAMS = {
    "default": LGMDParams(),
    "fixed inhibition": LGMDParams.fixed_inhibition(),
    "off only": LGMDParams.off_only(),
    "literal": LGMDParams.literal(),
    "no persistence": LGMDParams(n_p=0, t_de=5.0, theta_1=0.6),
    "one frame": LGMDParams(n_p=1, u=0.5, tau_s=np.inf, t_f=np.inf, weights=(0.5, 0.3, 0.1)),
}
FLOAT_ONLY = {
    "released": LGMDParams.released(),
    "long persistence": LGMDParams(n_p=4, u=1.5),
    "product": LGMDParams(on_off_residue=0.5, theta_3=0.1, tau_s=0.0, spikes_from="membrane"),
}
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler; set CC or install cc")


def compile_c(folder, shape, params=None, *, fixed=False, fps=30.0):
    """Export and compile a neuron; return the path of the program."""
    export_c(folder, shape, fps, params)
    program, options = folder / "lgmd", ["-DLGMD_FIXED"] if fixed else []
    files = [str(folder / name) for name in ("main.c", "lgmd.c")]
    command = [COMPILER, *STRICT, *options, "-o", str(program), *files, "-lm"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    return program


def run(program, data):
    done = subprocess.run([str(program)], input=data, capture_output=True)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def pgm(frames):
    head = f"P5\n{frames.shape[2]} {frames.shape[1]}\n255\n".encode()
    return b"".join(head + frame.tobytes() for frame in frames)


def trace(program, data):
    code, output, error = run(program, data)
    assert (code, error) == (0, "")
    assert output.splitlines()[0] == "frame,time_s," + ",".join(COLUMNS) + ",alert"
    return np.loadtxt(io.StringIO(output), delimiter=",", skiprows=1, ndmin=2)


def reference(frames, params, fps=30.0):
    neuron = ReferenceLGMD(frames.shape[1:], fps, params)
    return np.array([neuron.step(frame) for frame in frames], float)[:, [0, 1, 2, 3, 4, 5, 7]]


def sequences(shape):
    textured = np.clip(looming(shape, 50).astype(int) + natural(shape, 50) // 4 - 32, 0, 255)
    clips = {"looming": looming(shape, 60), "textured": textured.astype(np.uint8)}
    return clips | {"natural": natural(shape, 25), "grating": grating(shape, 25), "random": random(shape, 25)}


@needs_compiler
@pytest.mark.parametrize("name", [*PARAMS, *FLOAT_ONLY])
def test_float_spikes_equal_those_of_the_reference(name, tmp_path):
    params, spikes = (PARAMS | FLOAT_ONLY)[name], 0
    program = compile_c(tmp_path, SHAPE, params)
    for frames in sequences(SHAPE).values():
        ours, expected = trace(program, pgm(frames))[:, 2:], reference(frames, params)
        assert np.array_equal(ours[:, [1, 6]], expected[:, [1, 6]])
        np.testing.assert_allclose(ours, expected, rtol=1e-5, atol=1e-5)
        spikes += expected[:, 1].sum()
    assert spikes > 0


@needs_compiler
@pytest.mark.parametrize("name", PARAMS)
def test_errors_of_fixed_point_are_small(name, tmp_path):
    """K within 0.005, F within 0.01 grey levels, spikes within one per frame.

    The adapted potential has no bound: a rise of K near t_sfa adapts in one of the two and not in the other.
    """
    program = compile_c(tmp_path, SHAPE, PARAMS[name], fixed=True)
    spiking = different = 0
    for frames in sequences(SHAPE).values():
        ours, expected = trace(program, pgm(frames))[:, 2:], reference(frames, PARAMS[name])
        error = np.abs(ours - expected).max(axis=0)
        assert error[2] < 0.005
        assert error[4] < 0.01
        assert error[1] <= 1
        spiking += np.count_nonzero(expected[:, 1])
        different += np.count_nonzero(ours[:, 1] != expected[:, 1])
    assert spiking > 0
    assert different <= 0.05 * spiking


@needs_compiler
def test_fixed_point_needs_less_than_96_kilobytes(tmp_path):
    sizes = []
    for fixed in (True, False):
        program = compile_c(tmp_path, SHAPE, fixed=fixed)
        done = subprocess.run([str(program), "--info"], capture_output=True, text=True, check=True)
        assert done.stdout.startswith("99 x 72 px, 30 Hz, ")
        sizes.append(int(done.stdout.split(", ")[2].split()[0]))
    assert 13 * 72 * 99 < sizes[0] <= 96_000
    assert sizes[1] == pytest.approx(37 * 72 * 99, rel=0.001)


@needs_compiler
@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (6, 2), (3, 5)])
def test_small_frames_have_replicated_borders(shape, fixed, tmp_path):
    params = LGMDParams(t_de=0.0, sigma_3=50.0)
    program, frames = compile_c(tmp_path, shape, params, fixed=fixed, fps=25.0), random(shape, 20)
    ours, expected = trace(program, pgm(frames))[:, 2:], reference(frames, params, fps=25.0)
    tolerance = 0.01 if fixed else 1e-5
    np.testing.assert_allclose(ours[:, 2], expected[:, 2], atol=tolerance)
    np.testing.assert_allclose(ours[:, 4], expected[:, 4], atol=0.02)


def y4m(frames, tags, chroma=b"", frame_tags=b""):
    head = f"YUV4MPEG2 W{frames.shape[2]} H{frames.shape[1]} {tags}\n".encode()
    return head + b"".join(b"FRAME" + frame_tags + b"\n" + frame.tobytes() + chroma for frame in frames)


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    if COMPILER is None:
        pytest.skip("no C compiler; set CC or install cc")
    return compile_c(tmp_path_factory.mktemp("c"), (9, 13))


def test_y4m_of_all_colour_formats_equals_pgm(program):
    frames = looming((9, 13), 20)
    expected = trace(program, pgm(frames))
    assert expected[:, 3].max() > 0
    sizes = {"mono": 0, "420jpeg": 70, "420mpeg2": 70, "422": 126, "444": 234, "411": 72}
    for name, size in sizes.items():
        data = y4m(frames, f"F30:1 Ip A1:1 C{name}", b"\x80" * size, b" Ixyz")
        assert np.array_equal(trace(program, data), expected)
    assert np.array_equal(trace(program, y4m(frames, "F30000:1001", b"\x80" * 70)), expected)
    limited = np.rint(16 + frames * (219 / 255)).astype(np.uint8)
    given = trace(program, y4m(limited, "F30:1 Cmono XCOLORRANGE=LIMITED"))
    np.testing.assert_allclose(given[:, 4], expected[:, 4], atol=0.02)


def test_pgm_headers_may_have_comments(program):
    frames = looming((9, 13), 20)
    data = b"".join(b"P5 # camera\n#two\n13\t9 255\n" + frame.tobytes() + b"\n" for frame in frames)
    assert np.array_equal(trace(program, data), trace(program, pgm(frames)))


PIXELS = bytes(9 * 13)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "stdin is empty; send Y4M or PGM"),
        (b"P6\n13 9\n255\n", "stdin must be Y4M, or PGM pictures that begin with P5"),
        (b"P5\n9 13\n255\n", "frames must be 13 x 9 px, got 9 x 13; use ffmpeg -vf scale=13:9"),
        (b"P5\n13 9\n65535\n", "the maximum of a PGM picture must be 255"),
        (b"P5\nabc", "a PGM header must have width, height and maximum"),
        (b"P5\n13 9\n255\n" + PIXELS[1:], "the last frame is incomplete"),
        (b"YUV4MPEG2 W640 H480 F30:1\n", "frames must be 13 x 9 px, got 640 x 480"),
        (b"YUV4MPEG2 W13 H9 F30:1 C420p10\n", "pixels must have 8 bits"),
        (b"YUV4MPEG2 W13 H9 F30:1 Cxyz\n", "the Y4M colour format must be mono, 420, 422, 444 or 411"),
        (b"YUV4MPEG2 W13 H9 F30:1 Cmono\nFRAMES" + PIXELS, "the last frame is incomplete"),
        (b"YUV4MPEG2 W13 H9 F30:1 Cmono\nPICTURE\n" + PIXELS, "FRAME is missing before a frame"),
    ],
)
def test_invalid_input_is_one_line(program, data, message):
    code, _, error = run(program, data)
    assert code == 2
    assert error.startswith(f"lgmd: {message}")
    assert error.count("\n") == 1


def test_another_frame_rate_is_noted(program):
    code, output, error = run(program, y4m(looming((9, 13), 2), "F25:1 Cmono"))
    assert (code, len(output.splitlines())) == (0, 3)
    assert error == "lgmd: the frame rate is 25:1 Hz, but the neuron is made for 30 Hz\n"


@needs_compiler
def test_fixed_point_refuses_what_it_does_not_cover(tmp_path):
    for params, reason in (("released", "on_off_residue = 0"), ("weight", "smaller theta_1")):
        export_c(
            tmp_path, (9, 13), 30.0, LGMDParams.released() if params == "released" else {"theta_1": 90.0}
        )
        command = [COMPILER, "-std=c99", "-DLGMD_FIXED", "-fsyntax-only", str(tmp_path / "lgmd.c")]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode != 0
        assert "LGMD_FIXED requires " + reason in done.stderr


def test_an_existing_main_is_kept(tmp_path):
    for name in FILES:
        (tmp_path / name).write_text("own")
    paths = export_c(tmp_path, SHAPE)
    assert [path.name for path in paths] == list(FILES)
    assert [path.read_text() == "own" for path in paths] == [False, False, True]


def test_the_command_exports_presets_with_options_and_parameters(tmp_path, capsys):
    LGMDParams(sigma_3=2.0).to_toml(tmp_path / "params.toml")
    out = tmp_path / "new" / "c"
    given = ["--shape", "48", "64", "--fps", "25", "--params", str(tmp_path / "params.toml")]
    assert cli.run(["neurons", "export-c", str(out), *given, "--neuron", "off-only:t_sp=0.78"]) == 0
    header = (out / "lgmd.h").read_text()
    expected = LGMDParams(theta_1=0.0, t_sp=0.78, sigma_3=2.0)
    assert header == c_sources((48, 64), 25.0, expected)["lgmd.h"]
    assert "#define LGMD_HEIGHT 48 " in header
    printed = capsys.readouterr().out
    assert f"cc -std=c99 -O2 -o {out / 'lgmd'} {out / 'main.c'} {out / 'lgmd.c'} -lm" in printed


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--neuron", "dsn"], "neuron must be the LGMD or one of its presets, got 'dsn'"),
        (["--neuron", "lgmd:tsp=1"], "did you mean 't_sp'"),
        (["--shape", "0", "64"], "shape must be (height, width)"),
    ],
)
def test_invalid_options_of_the_command_are_one_line(options, message, tmp_path, capsys):
    assert cli.run(["neurons", "export-c", str(tmp_path / "c"), *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "c").exists()


def test_sources_allocate_nothing_and_name_every_parameter():
    sources = c_sources(SHAPE)
    assert tuple(sources) == FILES
    assert "alloc" not in sources["lgmd.c"]
    assert "${" not in sources["lgmd.h"]
    named = sources["lgmd.h"] + "theta_3 u"
    assert [name for name in LGMDParams().to_dict() if name not in named and name != "whole_ms"] == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"shape": (0, 5)}, r"shape must be \(height, width\)"),
        ({"shape": SHAPE, "fps": -1.0}, "fps must be > 0"),
        ({"shape": SHAPE, "params": {"tsp": 0.5}}, "did you mean 't_sp'"),
        (
            {"shape": SHAPE, "params": {"sigma_4": 90.0}},
            r"allow 5\.32e\+11 spikes per frame, .*; lower sigma_4",
        ),
    ],
)
def test_invalid_arguments_are_one_line(options, message):
    with pytest.raises(ValueError, match=message) as error:
        c_sources(**options)
    assert "\n" not in str(error.value)

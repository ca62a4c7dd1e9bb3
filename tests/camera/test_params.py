import dataclasses
import json
import math
import subprocess
import sys

import pytest

from lgmd_gym.camera import CONDITIONS, PRESETS, CameraParams, EgoCamera


def test_presets_have_their_documented_lenses():
    assert {n: (p.hfov_deg, p.shape) for n, p in PRESETS.items()} == {
        "wide": (60.0, (90, 160)),
        "standard": (40.0, (90, 160)),
        "tele": (25.0, (90, 160)),
        "fovea": (10.0, (90, 160)),
        "paper": (60.0, (288, 352)),
    }
    assert all(p.name == n for n, p in PRESETS.items())


def test_docstring_states_the_pixels_per_degree():
    for name, px in {"wide": 2.4, "standard": 3.8, "tele": 6.3, "fovea": 16.0, "paper": 5.3}.items():
        assert PRESETS[name].pixels_per_degree == pytest.approx(px, abs=0.06)
        assert f"`{name}` {px}" in CameraParams.__doc__


def test_focal_length_of_a_right_angle():
    assert CameraParams(hfov_deg=90.0).focal_px == pytest.approx(80.0)


def test_params_are_hashable_and_round_trip_through_json():
    for params in (*PRESETS.values(), CameraParams.preset("tele").with_condition("rain")):
        plain = json.loads(json.dumps(dataclasses.asdict(params)))
        assert CameraParams.make(plain) == params
        assert hash(CameraParams.make(plain)) == hash(params)


def test_make_accepts_name_params_and_dict():
    fovea = CameraParams.preset("fovea")
    assert CameraParams.make("fovea") is fovea
    assert CameraParams.make(fovea) is fovea
    assert CameraParams.make({"name": "fovea", "seed": 7}) == CameraParams.preset("fovea", seed=7)
    assert CameraParams.make({"name": "mine", "hfov_deg": 7.0}).hfov_deg == 7.0
    assert CameraParams.make({"name": "fovea", "condition": "rain"}) == fovea.with_condition("rain")
    assert CameraParams.make(fovea, condition="fog", seed=7) == CameraParams.preset(
        "fovea", visibility_m=120.0, seed=7
    )
    assert CameraParams.make("wide", shape=[45, 80]).shape == (45, 80)


BAD_VALUES = [
    (lambda: CameraParams.make("foeva"), ["foeva", "fovea"]),
    (lambda: CameraParams.make({"hfov": 5.0}), ["hfov", "hfov_deg"]),
    (lambda: CameraParams.make("wide", pich_deg=1.0), ["pich_deg", "pitch_deg"]),
    (lambda: CameraParams(hfov_deg=1.0), ["hfov_deg", "1.0", "(1, 170)"]),
    (lambda: CameraParams(hfov_deg=170.0), ["hfov_deg", "170"]),
    (lambda: CameraParams(hfov_deg=math.nan), ["hfov_deg", "nan"]),
    (lambda: CameraParams(hfov_deg="60"), ["hfov_deg", "'60'"]),
    (lambda: CameraParams(mount_height=0.0), ["mount_height", "0.0", "ground"]),
    (lambda: CameraParams(mount_height=-1.0), ["mount_height", "-1.0"]),
    (lambda: CameraParams(shape=(160,)), ["shape", "(160,)"]),
    (lambda: CameraParams(shape=(0, 160)), ["shape", "0"]),
    (lambda: CameraParams(shape=(90.0, 160)), ["shape", "90.0"]),
    (lambda: CameraParams(gaze="pth"), ["gaze", "pth", "path"]),
    (lambda: CameraParams(seed=1.5), ["seed", "1.5"]),
    (lambda: CameraParams(seed=-1), ["seed", "-1"]),
    (lambda: CameraParams(texture=-0.1), ["texture", "-0.1"]),
    (lambda: CameraParams().with_condition("robots"), ["robots", "rain"]),
    (lambda: CameraParams(brake_known="no"), ["brake_known", "'no'"]),
    (lambda: EgoCamera("fove"), ["fove", "fovea"]),
]


def test_errors_name_the_field_the_value_and_the_fix():
    incomplete = []
    for call, words in BAD_VALUES:
        with pytest.raises(ValueError) as error:
            call()
        message = str(error.value)
        if "\n" in message or not all(word in message for word in words):
            incomplete.append(message)
    assert incomplete == []


def test_camera_of_a_wrong_type_is_an_error():
    with pytest.raises(ValueError, match="preset name"):
        CameraParams.make(3.0)


def test_every_condition_but_clear_changes_the_default_camera():
    assert CameraParams().with_condition("clear") == CameraParams()
    for name, fields in CONDITIONS.items():
        assert name == "clear" or CameraParams().with_condition(name) != CameraParams(), fields


def test_a_camera_needs_neither_highway_env_nor_the_neuron():
    code = (
        "import sys, lgmd_gym; before = set(sys.modules); import lgmd_gym.camera as c; c.EgoCamera('wide');"
        "new = set(sys.modules) - before; print([m for m in ('highway_env', 'gymnasium', 'pandas',"
        " 'matplotlib', 'torch', 'cv2', 'pygame', 'lgmd_gym.neuron') if m in new])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"

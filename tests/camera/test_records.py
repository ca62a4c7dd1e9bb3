import json
import math
import subprocess
import sys

import pytest
from support.cameras import ego_camera, rig

from lgmd_gym.camera import (
    PRESETS,
    WEATHERS,
    AlongPath,
    Camera,
    ImageSensor,
    Mount,
    Scene,
    ToStoppingPoint,
    Weather,
)


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
        assert f"`{name}` {px}" in Camera.__doc__


def test_focal_length_of_a_right_angle():
    assert Camera(hfov_deg=90.0).focal_px == pytest.approx(80.0)


CAMERAS = (
    *PRESETS.values(),
    Camera(
        gaze=ToStoppingPoint(reach=0.5), mount=Mount(yaw_deg=3.0, calibrated=True), stabiliser="gyroscope"
    ),
    Camera(gaze=AlongPath(derotated=True), sensor=ImageSensor(contrast_s=0.5), shape=(30, 40)),
)


@pytest.mark.parametrize("camera", CAMERAS)
def test_cameras_are_hashable_and_round_trip_through_json(camera):
    plain = json.loads(json.dumps(camera.to_dict()))
    assert Camera.make(plain) == camera
    assert hash(Camera.make(plain)) == hash(camera)


@pytest.mark.parametrize("weather", [*WEATHERS, Weather(light="night", visibility_m=30.0)])
def test_scenes_are_hashable_and_round_trip_through_json(weather):
    scene = Scene(world=7, weather=weather, texture=0.5, queue_lane=2)
    plain = json.loads(json.dumps(scene.to_dict()))
    assert Scene.make(plain) == scene
    assert hash(Scene.make(plain)) == hash(scene)


def test_make_accepts_name_record_and_dict():
    fovea = Camera.make("fovea")
    assert Camera.make("fovea") is PRESETS["fovea"]
    assert Camera.make(fovea) == fovea
    assert Camera.make({"name": "fovea", "stabiliser": "gyroscope"}) == Camera.make(
        "fovea", stabiliser="gyroscope"
    )
    assert Camera.make({"name": "mine", "hfov_deg": 7.0}).hfov_deg == 7.0
    assert Camera.make("wide", shape=[45, 80]).shape == (45, 80)
    assert Camera.make() == PRESETS["wide"]
    assert Camera(gaze="path") == Camera(gaze={"kind": "path"}) == Camera(gaze=AlongPath())
    assert Scene(weather={"name": "fog", "wet": True}).weather == Weather.make("fog", wet=True)
    assert Scene(world="laboratory") == Scene()


BAD_VALUES = [
    (lambda: rig("foeva"), ["foeva", "fovea"]),
    (lambda: Camera.make({"hfov": 5.0}), ["hfov", "hfov_deg"]),
    (lambda: Mount.make({"pich_deg": 1.0}), ["pich_deg", "pitch_deg"]),
    (lambda: rig(hfov_deg=1.0), ["hfov_deg", "1.0", "(1, 170)"]),
    (lambda: rig(hfov_deg=170.0), ["hfov_deg", "170"]),
    (lambda: rig(hfov_deg=math.nan), ["hfov_deg", "nan"]),
    (lambda: rig(hfov_deg="60"), ["hfov_deg", "'60'"]),
    (lambda: rig(height_m=0.0), ["mount height_m", "0.0", "(0, 100] m"]),
    (lambda: rig(height_m=-1.0), ["mount height_m", "-1.0"]),
    (lambda: rig(shape=(160,)), ["shape", "(160,)"]),
    (lambda: rig(shape=(0, 160)), ["shape", "0"]),
    (lambda: rig(shape=(90.0, 160)), ["shape", "90.0"]),
    (lambda: rig(gaze="pth"), ["gaze", "pth", "path"]),
    (lambda: rig(seed=1.5), ["seed", "1.5"]),
    (lambda: rig(seed=-1), ["seed", "-1"]),
    (lambda: rig(texture=-0.1), ["texture", "-0.1"]),
    (lambda: Scene(weather="robots"), ["robots", "rain"]),
    (lambda: rig(gaze="stopping", brake_known="no"), ["brake_known", "'no'"]),
    (lambda: ego_camera("fove"), ["fove", "fovea"]),
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


def test_records_of_a_wrong_type_are_errors():
    with pytest.raises(ValueError, match=r"camera must be a name, Camera or Mapping, got 3\.0"):
        Camera.make(3.0)
    with pytest.raises(ValueError, match="scene must be Scene or Mapping, got 'night'"):
        Scene.make("night")


def test_every_weather_but_clear_changes_the_scene():
    assert all((Scene(weather=name) == Scene()) == (name == "clear") for name in WEATHERS)


def test_a_camera_needs_neither_highway_env_nor_the_neuron():
    code = (
        "import sys, lgmd_gym; before = set(sys.modules); import lgmd_gym.camera as c; c.EgoCamera('wide');"
        "new = set(sys.modules) - before; print([m for m in ('highway_env', 'gymnasium', 'pandas',"
        " 'matplotlib', 'torch', 'cv2', 'pygame', 'lgmd_gym.neuron') if m in new])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"

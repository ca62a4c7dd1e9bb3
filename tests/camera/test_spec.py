"""Named conditions on the `camera` argument."""

import pytest

from lgmd_gym.camera import CONDITIONS, PRESETS, CameraParams, with_condition


@pytest.mark.parametrize("condition", CONDITIONS)
def test_name_params_and_dict_give_the_same_camera(condition):
    expected = PRESETS["fovea"].with_condition(condition)
    for camera in ("fovea", PRESETS["fovea"], {"name": "fovea"}):
        assert CameraParams.make(with_condition(camera, condition)) == expected


def test_clear_returns_the_argument():
    for camera in ("fovea", "birdseye", {"name": "fovea", "condition": "fog"}, ["wide", "birdseye"]):
        assert with_condition(camera, "clear") is camera


def test_explicit_fields_of_a_dict_take_precedence():
    camera = with_condition({"name": "tele", "read_noise": 0.0, "condition": "night"}, "rain")
    assert camera == CameraParams.preset("tele", **{**CONDITIONS["rain"], "read_noise": 0.0})


def test_every_camera_of_a_sequence_is_changed():
    cameras = with_condition(("fovea", {"name": "near", "hfov_deg": 80.0}), "fog")
    assert [(camera.name, camera.visibility_m) for camera in cameras] == [("fovea", 120.0), ("near", 120.0)]


@pytest.mark.parametrize(
    ("camera", "condition", "message"),
    [
        ("fovea", "fgo", "unknown camera condition 'fgo'; did you mean 'fog'?"),
        ("fova", "fog", "unknown camera preset 'fova'; did you mean 'fovea'?"),
        ("birdseye", "night", "camera 'birdseye' does not support condition 'night'; use 'clear'"),
        (["wide", {"name": "birdseye"}], "fog", "camera 'birdseye' does not support condition 'fog'"),
    ],
)
def test_errors_name_the_value_and_the_fix(camera, condition, message):
    with pytest.raises(ValueError) as error:
        with_condition(camera, condition)
    assert message in str(error.value)

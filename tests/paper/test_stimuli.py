"""Tests of the synthetic stimuli: positions of edges, luminance of gratings, anti-aliasing."""

import itertools
import re

import numpy as np
import pytest

from lgmd_gym import LGMD
from lgmd_gym.paper.backgrounds import (
    PAPER_SPEED,
    SHAPES,
    Grating,
    Panorama,
    Plain,
    Screen,
    natural_image,
)
from lgmd_gym.paper.stimuli import (
    Elongating,
    Looming,
    Receding,
    ScreenBox,
    Translating,
    coverage,
    stimulus_frames,
)


def area(outline, half, x=0.0, shape=(60, 80)):
    return coverage(ScreenBox(x, 0.0, half, half), outline, shape).sum()


@pytest.mark.parametrize("half", [0.3, 1.0, 4.0, 7.35, 20.2])
def test_objects_cover_their_area(half):
    assert area("square", half) == pytest.approx((2 * half) ** 2)
    assert area("disc", half) == pytest.approx(np.pi * half**2, rel=0.02)


@pytest.mark.parametrize("outline", ["square", "disc"])
def test_an_edge_can_move_by_tenths_of_a_pixel(outline):
    """Each tenth adds a tenth of the pixels along the edge."""
    steps = np.diff([area(outline, 10.0 + tenth / 10) for tenth in range(11)])
    assert steps.max() < 1.6 * steps.min()
    shifted = [coverage(ScreenBox(x, 0.0, 5.0, 5.0), outline, (40, 60)) for x in np.arange(0.0, 2.0, 0.1)]
    for a, b in itertools.pairwise(shifted):
        assert np.abs(a - b).max() <= 0.1 + 1e-9
        assert b.sum() == pytest.approx(a.sum(), rel=0.01)


def test_the_angle_of_a_looming_object_is_two_atan_of_l_over_v():
    screen = Screen()
    square = Looming(l_over_v=0.1, contact=3.0, largest=80.0)
    for left in (2.0, 1.0, 0.2, 0.1):
        angle = 2 * np.arctan(square.box(3.0 - left, screen).half_width / screen.focal)
        assert angle == pytest.approx(2 * np.arctan(0.1 / left))
    assert square.box(5.0, screen) == square.box(3.0, screen)  # it stops at its largest size
    away = Receding(l_over_v=0.1, contact=1.0, largest=80.0)
    assert away.box(1.7, screen).half_width == pytest.approx(square.box(2.3, screen).half_width)
    assert away.box(0.0, screen) == away.box(1.0, screen)


def test_the_papers_speed_is_six_pixels_per_frame_at_18_hz():
    screen = Screen(fps=18.0)
    for foreground, edge in ((Translating(), "x"), (Elongating(), "half_width")):
        before, after = (getattr(foreground.box(n / 18.0, screen), edge) for n in (3, 4))
        assert after - before == pytest.approx(6.0)
    assert pytest.approx(0.108) == PAPER_SPEED
    assert Elongating(all_round=False).box(1.0, screen).half_height == pytest.approx(10.0)


def test_a_grating_has_the_given_period_contrast_and_drift():
    screen = Screen(shape=(20, 400))
    grating = Grating(spatial=10.0, temporal=3.0, contrast=0.5)  # a period of 100 px
    row = grating.render(0.0, screen)[0]
    assert (row.min(), row.max()) == pytest.approx((127.5 * 0.5, 127.5 * 1.5), abs=0.3)
    assert row[100:] == pytest.approx(row[:-100])
    later = grating.render(0.1, screen)[0]  # 0.3 periods further to the right
    assert later[30:] == pytest.approx(row[:-30])
    upward = Grating(spatial=10.0, direction=90.0)
    now, then = upward.render(0.0, screen)[:, 0], upward.render(0.05, screen)[:, 0]  # 10 px up
    assert then[:10] == pytest.approx(now[10:])


def test_the_contrast_of_a_fine_grating_is_averaged_over_pixels():
    screen = Screen(shape=(8, 64))
    swing = [
        np.ptp(Grating(spatial=spatial, direction=0.0).render(0.013, screen)) for spatial in (20, 300, 1000)
    ]
    assert swing[0] > 250
    assert swing[1] < swing[0]
    assert swing[2] == pytest.approx(0.0, abs=1e-6)


def test_a_panorama_shifts_and_is_periodic():
    screen = Screen(shape=(30, 50), px_per_m=1000.0)
    view = Panorama(speed=0.01)  # 10 px/s to the left
    first, later = view.render(0.0, screen), view.render(1.0, screen)
    assert later[:, :-10] == pytest.approx(first[:, 10:])
    assert view.render(10.0, screen) == pytest.approx(first)
    half = view.render(0.05, screen)
    assert half[:, :-1] == pytest.approx((first[:, :-1] + first[:, 1:]) / 2)


def test_a_natural_image_has_a_one_over_f_spectrum():
    picture = natural_image((128, 256), contrast=0.1)
    power = np.abs(np.fft.rfft(picture - picture.mean(), axis=1)).mean(0)
    slope = np.polyfit(np.log(np.arange(3, 60)), np.log(power[3:60]), 1)[0]
    assert -1.3 < slope < -0.3  # amplitude of one row; that of the image is -1
    assert picture.std() / picture.mean() == pytest.approx(0.1, rel=0.1)
    assert (natural_image((9, 9), seed=1) != natural_image((9, 9), seed=2)).any()


def test_an_image_file_is_scaled_to_the_screen(tmp_path):
    from PIL import Image

    pixels = np.random.default_rng(0).integers(0, 255, (17, 23), np.uint8)
    Image.fromarray(pixels).save(tmp_path / "here.png")
    view = Panorama(picture=tmp_path / "here.png", speed=0.0).render(0.0, Screen(shape=(34, 46)))
    reduced = view.reshape(17, 2, 23, 2).mean((1, 3))
    assert np.corrcoef(reduced.ravel(), pixels.ravel())[0, 1] > 0.9
    assert Panorama(picture=tmp_path / "here.png").render(0.4, Screen(shape=(31, 90))).shape == (31, 90)
    (tmp_path / "text.png").write_text("not an image")
    for name, message in (("text.png", "not an image that Pillow"), ("nowhere.png", "cannot be read")):
        with pytest.raises(ValueError, match=message):
            Panorama(picture=tmp_path / name)


@pytest.mark.parametrize("shape", SHAPES.values())
@pytest.mark.parametrize("fps", [18.0, 30.0])
def test_frames_are_grey_uint8_in_every_size(shape, fps):
    made = list(stimulus_frames(Screen(shape=shape, fps=fps), 0.2, Panorama(), Looming(contact=0.5)))
    assert len(made) == round(0.2 * fps)
    assert all(frame.dtype == np.uint8 and frame.shape == shape for frame in made)


def test_the_neuron_responds_most_to_an_approach():
    screen = Screen(shape=(90, 180), px_per_m=1000 / 3)

    def spikes(foreground, background=None):
        neuron = LGMD(screen.shape, screen.fps)
        return sum(
            neuron.step(frame).spikes for frame in stimulus_frames(screen, 2.0, background, foreground)
        )

    approach, recede = spikes(Looming(contact=2.0)), spikes(Receding())
    assert approach > 2 * recede > 0
    assert approach > 2 * spikes(Translating(centred=1.0))
    assert spikes(None, Grating()) == 0
    assert spikes(None, Plain(luminance=3.0)) == 0


@pytest.mark.parametrize(
    ("field", "message"),
    [
        ({"shape": (0, 4)}, "got (0, 4)"),
        ({"fps": 0.0}, "fps must be > 0"),
        ({"px_per_m": -1.0}, "px_per_m must"),
    ],
)
def test_an_invalid_screen_is_rejected(field, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        Screen(**field)

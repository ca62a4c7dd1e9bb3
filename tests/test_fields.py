"""Declared fields of records: checks, defaults, documentation and plain values."""

import math

import pytest

from lgmd_gym.fields import Record, choice, declarations, flag, number, numbers, optional, record, whole


@record
class Lens(Record):
    """Optics.

    Further text.
    """

    label = "lens"
    focal_mm: float = number(6.0, "(0, 100]", "mm", "Focal length.", search=(2.0, 12.0))
    blades: int = whole(5, "[3, 16]", doc="Number of blades.")
    tau_ms: float = number(10.0, "[0, inf]", "ms", "Time constant.")
    weights: tuple[float, float] = numbers((1.0, 2.0), "[0, inf)", doc="Weights.")
    coated: bool = flag(True, "Whether the glass is coated.")
    mount: str = choice("c", ("c", "cs"), "Thread.")
    seed: int | None = optional(whole(0, "[0, inf)", doc="Seed."))


def test_defaults_and_changes():
    assert Lens().to_dict() == {
        "focal_mm": 6.0, "blades": 5, "tau_ms": 10.0, "weights": [1.0, 2.0], "coated": True, "mount": "c",
        "seed": None,
    }  # fmt: skip
    assert Lens.make({"focal_mm": 8}, blades=7.0) == Lens(focal_mm=8.0, blades=7)
    assert Lens.make(Lens(blades=4), seed=3) == Lens(blades=4, seed=3)
    assert type(Lens.make({"focal_mm": 8}).focal_mm) is float


@pytest.mark.parametrize(("values", "message"), [
    ({"focal_mm": 0}, r"lens focal_mm must be in \(0, 100\] mm, got 0"),
    ({"focal_mm": math.inf}, "lens focal_mm must be finite, got inf"),
    ({"focal_mm": math.nan}, "lens focal_mm must be finite, got nan"),
    ({"focal_mm": True}, "lens focal_mm must be a number, got True"),
    ({"blades": 3.5}, r"lens blades must be a whole number in \[3, 16\], got 3.5"),
    ({"blades": math.inf}, r"lens blades must be a whole number in \[3, 16\], got inf"),
    ({"blades": 17}, r"lens blades must be in \[3, 16\], got 17"),
    ({"weights": [1]}, r"lens weights must be 2 numbers, got \[1\]"),
    ({"weights": [1, -1]}, r"lens weights must be in \[0, inf\), got -1"),
    ({"coated": 1}, "lens coated must be true or false, got 1"),
    ({"mount": "f"}, "unknown lens mount 'f'; known: c, cs"),
    ({"seed": -1}, r"lens seed must be in \[0, inf\), got -1"),
    ({"focal": 1}, "unknown lens field 'focal'; did you mean 'focal_mm'?"),
])  # fmt: skip
def test_wrong_values(values, message):
    with pytest.raises(ValueError, match=message):
        Lens.make(values)


def test_infinity_where_the_range_includes_it():
    assert Lens(tau_ms=math.inf).tau_ms == math.inf
    with pytest.raises(ValueError, match="tau_ms must be finite"):
        Lens(tau_ms=-math.inf)


def test_documentation():
    assert "focal_mm: Focal length [mm]; in (0, 100]; default 6.0." in Lens.__doc__
    assert "mount: Thread; one of 'c', 'cs'; default 'c'." in Lens.__doc__
    assert declarations(Lens)[0].search == (2.0, 12.0)

"""Trailers: paths of their axles, by hand, and contacts with them."""

from math import hypot

import pytest
from support.openscenario import (
    AWAY,
    AXLES,
    SIZE,
    START,
    at,
    compiled,
    event,
    scenario,
    story,
    vehicle,
)

from lgmd_gym.envs.dynamics.script import Bend
from lgmd_gym.openscenario.bodies import EntityBody, Trailer
from lgmd_gym.openscenario.motion import Place, Track
from lgmd_gym.openscenario.nodes import Element, Node
from lgmd_gym.openscenario.trailers import follow_hitch

BODY = EntityBody(kind="box", length=4.0, width=2.0, height=1.5, reference=0.0)


def trailer(folder, hitch, coupler):
    return Trailer(Element(Node("Trailer", {}, folder, 1), {}), "t", BODY, hitch, coupler)


@pytest.mark.parametrize(("hitch", "coupler"), [(-1.0, 8.0), (1.0, 8.0), (0.0, 12.0)])
def test_a_circle(tmp_path, hitch, coupler):
    """The hitch is at √(R² + hitch²) from the centre, and the axle at √(R² + hitch² - coupler²)."""
    found = follow_hitch(Track(Place(0.0, 0.0, 0.0), (Bend(600.0, 0.01),)), trailer(tmp_path, hitch, coupler))
    radius = (100.0**2 + hitch**2 - coupler**2) ** 0.5
    place = found.track.at(500.0 * found.share)
    # One share of the speed for the whole path, although the trailer is straight behind its vehicle at first.
    assert found.share == pytest.approx(radius / 100.0, abs=1.5e-3)
    assert abs(hypot(place.x, place.y - 100.0) - radius) < found.deviation(500.0) < 0.4
    assert found.track.curvature(500.0 * found.share) == pytest.approx(1.0 / (100.0 * found.share))


def test_a_change_of_lane(tmp_path):
    """The coupler stays at the hitch, and the trailer is behind its vehicle again."""
    bends = tuple(Bend(15.0, *ends) for ends in ((0, 0.01), (0.01, 0), (0, -0.01), (-0.01, 0)))
    path, pulled = Track(Place(0.0, 0.0, 0.0), bends), trailer(tmp_path, -2.0, 6.0)
    found = follow_hitch(path, pulled)
    for distance in (0.0, 15.0, 30.0, 45.0, 60.0, 100.0, 300.0):
        hitch, coupler = path.at(distance).moved(-2.0), found.track.at(distance * found.share).moved(6.0)
        assert hitch.distance(coupler) < 0.06
        assert abs(hitch.seen_from(coupler).y) < 0.005
    assert found.track.at(300.0).heading == pytest.approx(path.at(300.0).heading, abs=1e-4)
    assert found.track.at(0.0) == (-8.0, 0.0, 0.0)
    assert found.share == 1.0
    assert found.deviation(3000.0) == pytest.approx(found.deviation(100.0))


def pulling(name, hitch=-3.0, coupler=5.0):
    """Return an entity with a trailer of 4 × 2 m, whose axle is below its centre."""
    own = (
        f'<TrailerHitch dx="{hitch}"/><Trailer><Trailer name="T"><Vehicle name="T" vehicleCategory="trailer">'
        f'<BoundingBox><Center x="0" y="0" z="0.7"/>{SIZE}</BoundingBox>{AXLES}'
        f'<TrailerCoupler dx="{coupler}"/>'
        "</Vehicle></Trailer></Trailer></Vehicle>"
    )
    return vehicle(name).replace("</Vehicle>", own)


def test_a_contact_with_a_trailer(tmp_path):
    """Its axle is 8 m behind the reference point of the target: the rear is 48 m ahead of the ego."""
    found = compiled(tmp_path, scenario(START, entities=vehicle("Ego") + pulling("Target")))
    assert found.contact == pytest.approx(4.8)
    assert [actor.kind for actor in found.scenario.actors] == ["box", "car"]
    assert found.target.name == "T"


def test_a_trailer_moves_with_its_vehicle(tmp_path):
    """The target accelerates from 1 s on; its trailer keeps its distance."""
    events = story("Target", event("E", AWAY, at(1)))
    found = compiled(tmp_path, scenario(START, events, entities=vehicle("Ego") + pulling("Target")))
    first, second = found.scenario.actors
    assert (first.profile, first.speed) == (second.profile, second.speed)
    assert abs(first.gap - second.gap) == pytest.approx(8.0)


def test_the_trailer_of_the_ego_is_left_out(tmp_path):
    found = compiled(tmp_path, scenario(START, entities=pulling("Ego") + vehicle("Target")))
    assert found.contact == pytest.approx(5.6)
    assert len(found.scenario.actors) == 1
    assert [note.split(": ", 1)[1] for note in found.notes] == [
        "the trailer of the ego 'Ego' is left out: it is behind the camera"
    ]


@pytest.mark.parametrize(
    ("entity", "message"),
    [
        (pulling("Target", coupler=0), "TrailerCoupler dx must be > 0 m, got 0"),
        (
            vehicle("Target").replace(
                "</Vehicle>", '<Trailer><TrailerRef entityRef="Ego"/></Trailer></Vehicle>'
            ),
            "a trailer that is an entity is not supported; put it into the vehicle",
        ),
    ],
)
def test_unsupported_trailers(tmp_path, entity, message):
    with pytest.raises(ValueError, match=rf"case\.xosc:\d+: {message}"):
        compiled(tmp_path, scenario(START, entities=vehicle("Ego") + entity))


def test_an_empty_reference_is_no_trailer(tmp_path):
    entity = vehicle("Target").replace(
        "</Vehicle>", '<Trailer><TrailerRef entityRef=""/></Trailer></Vehicle>'
    )
    assert compiled(tmp_path, scenario(START, entities=vehicle("Ego") + entity)).contact == pytest.approx(5.6)

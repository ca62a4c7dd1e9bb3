"""Outcomes of braking in traffic: speed lost, needless brakes, contacts avoided, caused and unavoidable."""

import gymnasium as gym
import pytest
from support.traffic import Recorded, errors_of

from lgmd_gym.agents import BRAKE, HOLD, make_agent, to_action
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.traffic.batch import TrafficDrive, TrafficTask, run_traffic_task
from lgmd_gym.benchmark.traffic.branch import Branch, avoids, branch_from
from lgmd_gym.benchmark.traffic.rows import BrakingEvent, measure
from lgmd_gym.benchmark.traffic.summary import summarise_traffic
from lgmd_gym.envs.appearance import Appearance
from lgmd_gym.envs.dynamics.brake import draw_brake
from lgmd_gym.envs.registration import TRAFFIC_KINDS, register_traffic, traffic_id
from lgmd_gym.rendering.playback import make_target

KINDS = {name.lower(): f"support.traffic:{name}" for name in ("Following", "Followed", "Standing")}
KINDS["empty"] = "support.traffic:EmptyHighway"


class Pulses:
    """Brakes in the given intervals [s] with a level, and holds between them."""

    alert = False

    def __init__(self, *intervals, level=BRAKE):
        self.intervals, self.level, self.decision = intervals, level, 0

    def reset(self, seed=None):
        """Keep the time, also after a standstill."""

    def act(self, observation, info):
        time = self.decision / 30
        self.decision += 1
        return to_action(self.level if any(a <= time < b for a, b in self.intervals) else HOLD)


@pytest.fixture(autouse=True)
def kinds(monkeypatch):
    for kind, path in KINDS.items():
        monkeypatch.setitem(TRAFFIC_KINDS, kind, path)
    register_traffic()
    yield
    for kind in KINDS:
        del gym.registry[traffic_id(kind)]


def play(kind, agent, seconds=12):
    """Return the log and the measured values of an agent in a kind of traffic."""
    recorded = Recorded(kind, config={"duration": seconds})
    log = recorded.replay(agent).log
    return log, measure(recorded.recording, log)


@pytest.mark.parametrize(("level", "loss"), [(BRAKE, 9.0), (-0.5, 4.5), (-0.2, 1.8)])
def test_speed_lost_in_a_pulse_of_one_second(level, loss):
    """Dead time and build-up shift a pulse and keep its area: 1 s of the demanded deceleration.

    A brake below 0.25 g is no activation but costs speed.
    """
    log, row = play("empty", Pulses((2.0, 3.0), level=level), 8)
    (event,) = log.events
    assert event.speed_lost == pytest.approx(loss, abs=0.03)
    assert row["speed_lost"] == event.speed_lost
    assert row["needless_activations"] == (level < -0.3)
    listed = [[2.0, pytest.approx(3.0 - 1 / 30, abs=1e-4), pytest.approx(loss, abs=0.03), 0]]
    assert row["activations"] == (listed if level < -0.3 else [])
    assert not row["caused"]


def test_released_brakes_are_separate_activations_and_the_drive_goes_on():
    """The second one is compared with a drive that has had the first one."""
    log, row = play("empty", Pulses((2.0, 2.5), (5.0, 6.0), (6.5, 6.6)), 20)
    first, second = row["activations"]
    assert (first[0], second[0]) == (2.0, 5.0)
    assert second[1] == pytest.approx(6.6 - 1 / 30, abs=1e-4)  # demands less than 1 s apart are one event
    assert first[2] == pytest.approx(4.5, abs=0.03)
    # In the drive without it, the driver meanwhile regains the speed.
    assert 9.0 < second[2] < 12.5
    assert row["speed_lost"] == pytest.approx(first[2] + second[2], abs=1e-3)
    assert (row["needless_activations"], row["brakes"], row["stops"]) == (2, 2, 0)
    assert log.end.info["ego_speed"] > 20.0
    assert row["duration"] == 20.0


def test_a_stop_loses_the_whole_speed_once():
    _, row = play("empty", Pulses((2.0, 9.0)), 8)
    ((_, end, loss, _),) = row["activations"]
    assert row["stops"] == 1
    assert end == pytest.approx(2.0 + 0.1333 + 0.1 + 25.0 / 9.0, abs=0.1)
    assert loss == pytest.approx(25.0, abs=0.5)


def test_contact_while_the_driver_looks_away_is_avoidable_and_avoided_by_a_needed_brake():
    log, row = play("following", Pulses((3.0, 5.5)))
    assert (row["threat"], row["avoidable"], row["avoided_by_brake"]) == (True, True, True)
    assert (row["needless_activations"], row["speed_lost"], row["caused"]) == (0, 0.0, False)
    assert row["activations"][0][3] == 1
    assert log.events[0].contact is not None


@pytest.mark.parametrize(
    ("agent", "brakes"), [(Pulses(), 0), (Pulses((0.1, 0.4)), 1), (Pulses((3.4, 6.0)), 1)]
)
def test_a_contact_without_a_brake_after_an_early_tap_or_a_late_brake_is_not_avoided(agent, brakes):
    _, row = play("following", agent)
    assert row["collision"]
    assert (row["avoidable"], row["avoided_by_brake"], row["caused"]) == (True, False, False)
    assert len(row["activations"]) == brakes


def test_a_contact_that_vanishes_because_of_earlier_braking_is_neither_avoided_nor_missed():
    _, row = play("following", Pulses((0.0, 2.5)))
    assert row["avoidable"]
    assert not row["collision"]
    assert row["avoided"] is True
    assert row["avoided_by_brake"] is None
    assert row["needless_activations"] == 1


def test_rear_end_contact_of_the_follower_is_caused_by_the_brake():
    _, row = play("followed", Pulses((2.0, 4.0)))
    assert (row["threat"], row["avoidable"], row["avoided_by_brake"]) == (False, None, None)
    assert (row["collision"], row["side"], row["caused"]) == (True, "rear", True)
    assert row["needless_activations"] == 1
    _, row = play("followed", Pulses((2.0, 2.2)))
    assert (row["collision"], row["caused"], row["needless_activations"]) == (False, False, 1)


def test_a_car_that_drives_into_the_standing_ego_is_not_avoidable_and_not_caused():
    for agent in (make_agent("no-brake"), Pulses((0.5, 1.0))):
        log, row = play("standing", agent)
        assert (row["threat"], row["collision"], row["side"]) == (True, True, "rear")
        assert (row["avoidable"], row["avoided_by_brake"], row["caused"]) == (False, None, False)
        assert log.end.info["ego_speed"] < 0.5
        values = {"error": None, "case": "traffic/standing/s0", "world": None}
        summary = summarise_traffic("a", "", [row | values])
        assert (summary.contacts, summary.standing, summary.unavoidable, summary.caused) == (1, 1, 1, 0)


def test_contact_of_the_drive_without_agent_at_most_3_s_later_is_not_caused():
    """The brake, 1 s before it, comes too late, and delays the contact."""
    log, row = play("following", Pulses((3.6, 6.0)))
    assert row["collision"]
    assert 4.6 < log.duration < 5.0
    assert not row["caused"]


def test_no_contact_is_avoided_by_braking_too_late_for_it():
    """Among the moments of the last 2 s before it, the early ones avoid it."""
    recorded = Recorded("following", config={"duration": 12})
    assert recorded.recording.avoidable
    contact = recorded.recording.contact
    onsets = list(range(contact - 60, contact, 6))
    avoided = [avoids(recorded.recording.fork(onset), contact + 90 - onset) for onset in onsets]
    assert avoided == sorted(avoided, reverse=True)
    assert avoided[0]
    assert not avoided[-1]


def test_need_is_scaled_to_the_brake_of_the_drive():
    wet = Recorded("empty", 0, SensorConfig(), {"duration": 1}, Appearance(world=8003, weather="rain"))
    full = draw_brake(8003, wet=True).max_deceleration
    assert wet.recording.scaled_emergency == pytest.approx(5.0 / 9.0 * full)
    assert Recorded("empty", config={"duration": 1}).recording.scaled_emergency == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("required", "flat", "needed"), [(4.9, None, True), (5.0, 2.0, True), (3.3, None, False)]
)
def test_an_event_is_needed_from_the_scaled_required_deceleration_on(required, flat, needed):
    class Recording:
        policy_hz, scaled_emergency = 30.0, 3.4

    values = [0.0] * 60 + [required] + [0.0] * 300
    branch = Branch(0, [20.0] * len(values), values, False, None, 30.0)
    event = BrakingEvent.begin(0, branch, Recording)
    assert event.time_to_emergency == flat
    assert (event.needed, event.contact) == (needed, None)
    event.peak = 9.0
    assert (event.false, event.needless) == (flat is None, not needed)


def test_a_staged_brake_is_judged_again_when_it_exceeds_a_quarter_g():
    """Without it, the required deceleration reaches the limit after 3.5 s; a contact follows after 9 s."""

    class Recording:
        policy_hz, scaled_emergency = 30.0, 5.0

    values = [0.0] * 105 + [6.0] * 166
    branch = Branch(0, [20.0] * len(values), values, True, None, 30.0)
    event = BrakingEvent.begin(0, branch, Recording)
    assert (event.needed, event.contact, event.time_to_emergency) == (False, None, None)
    event.judge(14, branch, Recording)
    assert not event.needed
    event.judge(15, branch, Recording)
    assert (event.needed, event.contact) == (True, None)
    event.judge(60, branch, Recording)
    assert (event.needed, event.contact) == (True, 9.0)


class Staged(Pulses):
    """Brakes by 2 m/s² from 0.3 s and fully from 3.0 s to 5.5 s."""

    def act(self, observation, info):
        time = self.decision / 30
        full = super().act(observation, info)
        return full if full[0] < HOLD or not 0.3 <= time < 3.0 else to_action(-2.0 / 9.0)


def test_a_needed_full_stage_makes_a_staged_brake_needed():
    log, _ = play("following", Staged((3.0, 5.5)))
    event = log.events[0]
    assert event.start == pytest.approx(0.3)
    assert event.time_to_emergency is None
    assert (event.counts, event.false, event.needless) == (True, True, False)


def test_branch_is_simulated_as_far_as_needed_and_leaves_the_environment_unchanged():
    recorded = Recorded("following", config={"duration": 12}).recording
    env = recorded.fork(30)
    branch = branch_from(env, 30)
    assert branch.speed(30) == env.ego.speed == recorded.moments[30].motion.speed
    assert branch.contact(40) is None
    assert branch.contact(400) == recorded.contact == len(recorded.moments) - 1
    assert branch.speed(recorded.contact) == recorded.moments[-1].motion.speed
    assert branch.speed(400) == recorded.moments[-1].motion.speed
    assert recorded.course.speed(30) == env.ego.speed
    assert recorded.course.contact(recorded.contact - 1) is None
    assert recorded.emergencies.contact == recorded.contact / 30


def test_inattentive_suite_has_its_own_cases_and_the_traffic_of_its_attention():
    drives = [TrafficDrive("two-way", 20_000, ("no-brake",))]
    drives.append(TrafficDrive("two-way", 20_000, ("no-brake",), suite="traffic-inattentive"))
    rows = run_traffic_task(TrafficTask(tuple(drives), SensorConfig()))
    assert [row["error"] for row in rows] == [None, None]
    assert [row["case"] for row in rows] == ["traffic/two-way/s20000", "traffic-inattentive/two-way/s20000"]
    assert [row["suite"] for row in rows] == ["traffic", "traffic-inattentive"]
    assert rows[0]["distance"] != rows[1]["distance"]
    env = make_target("traffic-inattentive/two-way", {}, camera=None)
    assert env.unwrapped.attention.glance_interval == 10.0
    assert errors_of().glances == ()

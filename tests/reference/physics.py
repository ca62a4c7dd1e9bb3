"""The physics of a braking scenario as plain Python objects: the reference of the compiled functions."""

from bisect import bisect_right
from collections import deque
from copy import copy
from math import asin, atan, copysign, cos, hypot, inf, sin, sqrt, tan

from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch
from lgmd_gym.envs.dynamics.script import Pose

GAUSS = ((0.5 - 0.15**0.5, 5 / 18), (0.5, 8 / 18), (0.5 + 0.15**0.5, 5 / 18))
MAX_SPEED, REGAIN_TIME, PASSED_DISTANCE = 40.0, 0.5, 2.0


def time_to_stop(speed, acceleration, jerk):
    if speed <= 0.0 and (acceleration < 0.0 or (acceleration == 0.0 and jerk <= 0.0)):
        return 0.0
    if jerk == 0.0:
        return -speed / acceleration if acceleration < 0.0 else inf
    under_root = acceleration * acceleration - 2.0 * jerk * speed
    if under_root < 0.0 or (acceleration >= 0.0 and jerk > 0.0):
        return inf
    root = sqrt(under_root)
    return (acceleration + root) / -jerk if acceleration >= 0.0 else 2.0 * speed / (root - acceleration)


def advance(speed, acceleration, target, jerk, dt):
    acceleration = target if jerk == inf else acceleration
    change = target - acceleration
    ramp, distance = min(abs(change) / jerk, dt), 0.0
    for duration, slope in ((ramp, copysign(jerk, change)), (dt - ramp, 0.0)):
        if duration <= 0.0:
            continue
        stop = time_to_stop(speed, acceleration, slope)
        if stop <= duration:
            return distance + stop * (speed + stop * (acceleration / 2 + stop * slope / 6)), 0.0, 0.0
        distance += duration * (speed + duration * (acceleration / 2 + duration * slope / 6))
        speed += duration * (acceleration + duration * slope / 2)
        acceleration = target if slope and ramp < dt else acceleration + duration * slope
    return distance, max(speed, 0.0), acceleration


def clothoid(x, y, heading, curvature, slope, distance):
    if curvature == 0.0 and slope == 0.0:
        return Pose(x + distance * cos(heading), y + distance * sin(heading), heading)
    for node, weight in GAUSS:
        part = node * distance
        angle = heading + part * (curvature + part * slope / 2)
        x, y = x + weight * distance * cos(angle), y + weight * distance * sin(angle)
    return Pose(x, y, heading + distance * (curvature + distance * slope / 2))


class Path:
    """Cells of at most about half a metre; a straight before and after them."""

    def __init__(self, start, bends):
        self.stations, self.cells, self.straight = [], [], not bends
        station, pose = 0.0, start
        for bend in bends:
            slope = -(bend.last_curvature - bend.curvature) / bend.length
            count = max(int(bend.length / 0.5), 1) if bend.curvature or slope else 1
            for number in range(count):
                curvature = -bend.curvature + slope * (bend.length / count) * number
                self.stations.append(station)
                self.cells.append((*pose, curvature, slope))
                pose = clothoid(*pose, curvature, slope, bend.length / count)
                station += bend.length / count
        self.stations.append(station)
        self.cells.append((*pose, 0.0, 0.0))

    def pose(self, distance):
        index = bisect_right(self.stations, distance) - 1
        x, y, heading, curvature, slope = self.cells[max(index, 0)]
        if index < 0:
            return Pose(x + distance * cos(heading), y + distance * sin(heading), heading)
        return clothoid(x, y, heading, curvature, slope, distance - self.stations[index])


class Script:
    """A speed that follows segments of acceleration."""

    def __init__(self, speed, segments):
        self.speed, self.acceleration, self.time, self.left = speed, 0.0, 0.0, list(segments)

    def step(self, dt):
        end, distance = self.time + dt, 0.0
        while self.left and self.left[0].start < end:
            segment = self.left[0]
            distance += self.move(0.0, inf, segment.start - self.time)
            jerk = abs(segment.acceleration) / segment.build_up if segment.build_up > 0.0 else inf
            distance += self.move(segment.acceleration, jerk, end - self.time)
            if (segment.final_speed - self.speed) * copysign(1.0, segment.acceleration) > 0.0:
                break
            self.left.pop(0)
            self.speed, self.acceleration = segment.final_speed, 0.0
        return distance + self.move(0.0, inf, end - self.time)

    def move(self, target, jerk, duration):
        if duration <= 0.0:
            return 0.0
        distance, self.speed, self.acceleration = advance(
            self.speed, self.acceleration, target, jerk, duration
        )
        self.time += duration
        return distance


class Body:
    """A body on a path."""

    def __init__(self, pose, bends, speed, profile, length, width, reference=0.0):
        x, y, heading = pose
        start = Pose(x - reference * cos(heading), y - reference * sin(heading), heading)
        self.path, self.script, self.reference = Path(start, bends), Script(speed, profile), reference
        self.length, self.width = float(length), float(width)
        self.x, self.y, self.heading = pose
        self.speed, self.acceleration, self.travelled, self.steering = speed, 0.0, 0.0, 0.0

    def centre(self, travelled):
        x, y, heading = self.path.pose(travelled)
        return Pose(x + self.reference * cos(heading), y + self.reference * sin(heading), heading)

    def move(self, distance):
        before = self.heading
        self.travelled += distance
        self.x, self.y, self.heading = self.centre(self.travelled)
        self.steering = 0.0
        if not self.path.straight and distance > 0.0:
            turned = (self.heading - before) / distance * self.length / 2
            self.steering = atan(2.0 * tan(asin(max(-0.7, min(0.7, turned)))))

    def step(self, dt):
        distance = self.script.step(dt)
        self.speed, self.acceleration = self.script.speed, self.script.acceleration
        self.move(distance)


class Ego(Body):
    """The car under test; demands become active after the delay of its brake."""

    def __init__(self, scenario, start, brake, throttle):
        super().__init__(
            start,
            scenario.ego_path,
            scenario.ego_speed,
            scenario.ego_profile,
            scenario.ego_length,
            scenario.ego_width,
            scenario.ego_reference,
        )
        self.brake, self.throttle = brake, throttle
        self.demand = self.last_put = self.time = self.yaw_rate = 0.0
        self.pending, self.on_script = deque(), True

    def put(self, demand):
        demand = demand if demand < 0.0 or self.throttle else 0.0
        if demand != self.last_put:
            self.last_put = demand
            self.pending.append((self.time + self.brake.delay, demand))

    def step(self, dt):
        heading, end, distance = self.heading, self.time + dt, 0.0
        self.parts = []
        while self.pending and self.pending[0][0] < end - 1e-9:
            due, demand = self.pending.popleft()
            if due > self.time:
                distance += self.drive(due - self.time)
                self.time = due
            self.demand = demand
        distance += self.drive(end - self.time)
        self.time = end
        self.move(distance)
        self.yaw_rate = (self.heading - heading) / dt

    def drive(self, duration):
        scripted, brake, demand = self.script.step(duration), self.brake, self.demand
        self.on_script = self.on_script and demand == 0.0
        if self.on_script:
            self.speed, self.acceleration = self.script.speed, self.script.acceleration
            self.parts.append((duration, None))
            return scripted
        if demand < 0.0:
            target = min(demand * brake.max_deceleration, self.script.acceleration)
        elif demand > 0.0:
            target = demand * brake.max_acceleration if self.speed < MAX_SPEED else 0.0
        else:
            deficit, limit = self.script.speed - self.speed, brake.regain_acceleration
            target = self.script.acceleration + min(max(deficit / REGAIN_TIME, -limit), limit)
        distance, self.speed, self.acceleration = advance(
            self.speed, self.acceleration, target, brake.jerk, duration
        )
        self.parts.append((duration, target))
        return distance

    @property
    def braking(self):
        return 0.0 if self.on_script else max(0.0, self.script.acceleration - self.acceleration)


class Motion:
    """The motion of a body within a step, made before it; used after it."""

    def __init__(self, body, dt):
        self.body, self.start, self.speed, self.dt = body, body.travelled, body.speed, dt
        self.acceleration, self.script = body.acceleration, copy(body.script)
        self.script.left = list(body.script.left)

    @property
    def distance(self):
        """Distance travelled in the step [m]."""
        return self.body.travelled - self.start

    def progress(self, part):
        """Return the distance covered at a part of the step, and the speed there."""
        if self.speed == self.body.speed:
            return part * self.distance, self.speed
        script, speed, acceleration = copy(self.script), self.speed, self.acceleration
        script.left, rest, distance = list(self.script.left), part * self.dt, 0.0
        for duration, target in getattr(self.body, "parts", [(inf, None)]):
            duration = min(duration, rest)
            rest -= duration
            if target is None:
                distance += script.step(duration)
                speed, acceleration = script.speed, script.acceleration
            else:
                jerk = self.body.brake.jerk
                moved, speed, acceleration = advance(speed, acceleration, target, jerk, duration)
                distance += moved
        return distance, speed

    def outline(self, part):
        """Return the outline at a part of the step."""
        pose = self.body.centre(self.start + self.progress(part)[0])
        return Rectangle(*pose, self.body.length, self.body.width)

    def uniform(self):
        """Return whether heading and speed are those of the start."""
        return self.speed == self.body.speed and self.outline(0.0).heading == self.body.heading

    def first_touch(self, other):
        """Return the time of the first touch as a part of the step, or inf."""
        a, c = self.outline(0.0), other.outline(0.0)
        reach = hypot(a.length, a.width) / 2 + hypot(c.length, c.width) / 2
        if hypot(c.x - a.x, c.y - a.y) > reach + abs(self.distance) + abs(other.distance):
            return inf
        count = 1 if self.uniform() and other.uniform() else 16
        for number in range(count):
            (a, b), (c, d) = (
                [motion.outline(part / count) for part in (number, number + 1)] for motion in (self, other)
            )
            a, c = (x._replace(heading=(x.heading + y.heading) / 2) for x, y in ((a, b), (c, d)))
            touch = first_touch(a, c, (b.x - a.x) - (d.x - c.x), (b.y - a.y) - (d.y - c.y))
            if touch <= 1.0:
                return (number + touch) / count
        return inf

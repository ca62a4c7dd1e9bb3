"""The traffic suites: agents on recorded traffic, their activations per 100 km and the contacts.

An IDM driver drives the ego and the agent can only add braking. A braking event counts if it decelerates the
ego by more than 0.25 g beyond the driver. It is false if it was not needed: without it, within 3 s, the ego
has no contact (with any part, regardless of fault) and its required deceleration does not reach 5 m/s², the
emergency braking of UN R152; see `lgmd_gym.envs.traffic.emergencies`. It is needless if the same holds with
that limit scaled to the brake of the drive. The tables print the share of the time in motion in which a brake
is needed. The driver never brakes harder than 6 m/s².

The traffic consists of highway-env's driver models, which keep their lanes. In the suite "traffic" they are
never distracted, so that contacts are rare; in "traffic-inattentive" they err, see
`lgmd_gym.envs.attention`. A rate holds for such traffic, not for real roads.
"""

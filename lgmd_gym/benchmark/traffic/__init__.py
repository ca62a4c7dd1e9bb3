"""The traffic suite: agents on recorded traffic, and their false activations per 100 km.

An IDM driver drives the ego and the agent can only add braking. A braking event counts if it decelerates the
ego by more than 0.25 g beyond the driver. It is false if, without it, the ego has no contact (with any part,
regardless of fault) within 10 s and the driver does not brake by 5 m/s² or more, the emergency braking of
UN R152. It is premature, and counted separately, if that emergency is more than 4 s away. The driver never
brakes harder than 6 m/s².

The traffic consists of highway-env's driver models, which are never distracted and keep their lanes, so
contacts are rare. A rate holds for such traffic, not for real roads.
"""

"""Scenario families: functions from SI arguments to a `Scenario`, their registry and their random distribution."""

"""highway-env roads and vehicles built from a `Scenario`."""

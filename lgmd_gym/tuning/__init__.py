"""Parameter search for rules on training levels."""

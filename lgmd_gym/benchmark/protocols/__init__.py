"""Test grids of the emergency-braking protocols, one module per document, with the source of every number."""

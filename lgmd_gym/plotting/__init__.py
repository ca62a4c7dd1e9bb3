"""The matplotlib style and the figures that several packages share."""

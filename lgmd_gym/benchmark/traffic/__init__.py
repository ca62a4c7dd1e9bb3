"""The traffic suite: recorded drives, replays of agents on them, rows and summaries."""

"""Offline training on recorded episodes."""

"""Figures in one matplotlib style; matplotlib is imported on first use."""

"""Cameras and neurons combined: sensor arrays, observation spaces, frame rates and frame buffers."""

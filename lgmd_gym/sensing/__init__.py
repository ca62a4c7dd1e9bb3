"""Cameras and neurons as one sensor: sensor arrays, observation spaces, frame rates and frame buffers."""

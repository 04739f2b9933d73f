"""Timing of models in separate processes, and detection of disturbances."""

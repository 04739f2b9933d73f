"""Timing in separate processes, and detection of disturbances."""

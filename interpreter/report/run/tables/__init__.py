"""Sections of a run's report that list."""

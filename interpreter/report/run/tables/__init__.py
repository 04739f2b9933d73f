"""Sections of a run's report with tables."""

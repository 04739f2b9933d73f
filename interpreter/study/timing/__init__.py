"""Timing in processes of their own, and what tells that a time was disturbed."""

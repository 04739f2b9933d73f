"""Processes that carry out tasks, and the journal of what is finished."""

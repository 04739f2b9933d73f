"""What a scene asks for and what that needs, with no array: tasks of a run, sweeps, walks of stability studies.

Imports rooms up to the metrics. To add a kind of task: a function in `plan` that yields it.
"""

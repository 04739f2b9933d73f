"""Plans of what a scene asks for: tasks of a run, values of sweeps, and walks of robustness studies.

No arrays are used here. Imports packages up to the metrics. To add a kind of task: write a function in `run_plan` that
yields it.
"""

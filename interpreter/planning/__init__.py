"""Plans of the work that a scene asks for: tasks of a run, values of sweeps, and points of robustness studies.

No arrays are used here. This package imports the packages up to the metrics. To add a kind of task: write a function in
`run_plan` that yields it.
"""

"""Stability studies: each model walked along each quantity to the edge of what it gets right, every point classified.

    robustness_study.py           all walks at once, through the pool    point_classification.py   from an outcome to
    one of nine words task_queue.py  who wants to know which point          pair_maps.py       coarse grids over pairs
    of quantities
    robustness_points.py          from values to a task and its key      validity_edges.py      what the walks found,
    as JSON reference_trust.py           how far the reference can be trusted   edge_remedies.py   why a model ends
    there, and
    what would help

What can be walked and where a walk looks is in `interpreter.planning`: quantities, ladder, walks.
"""

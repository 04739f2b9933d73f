"""Stability studies: each model walked along each quantity to the edge of what it gets right, every point classified.

    queue.py           all walks at once, through the pool    classify.py   from an outcome to one of nine words
    waiting_points.py  who wants to know which point          maps.py       coarse grids over pairs of quantities
    points.py          from values to a task and its key      edges.py      what the walks found, as JSON
    truth.py           how far the reference can be trusted   remedies.py   why a model ends there, and what would help

What can be walked and where a walk looks is in `interpreter.plan`: quantities, ladder, walks.
"""

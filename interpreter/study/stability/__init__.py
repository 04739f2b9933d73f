"""Stability studies: each model walked along each quantity to the edge of what it gets right, every point classified.

    quantities.py  what can be walked and how far        ladder.py   where a walk looks, in order and between
    asking.py      what a study asks, and what is wrong  walk.py     outward, then each edge bisected
    points.py      from values to a task and its key     classify.py from an outcome to one of nine words
    truth.py       how far the reference can be trusted  maps.py     coarse grids over pairs of quantities
    engine.py      all walks at once, through the pool   edges.py    what the walks found, as JSON
    remedies.py    why a model ends there, and what would move the edge
"""

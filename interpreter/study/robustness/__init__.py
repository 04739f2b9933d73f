"""Robustness studies: each quantity is varied until a model is no longer right, and every point is classified.

    robustness_study       all walks at once, in worker processes
    robustness_points      the scene and the task at given values
    point_classification   class of an outcome, one of nine
    reference_uncertainty  uncertainty of the reference
    task_queue             tasks, and callbacks for their outcomes
    validity_maps          coarse grids over pairs of quantities
    validity_edges         edges that the walks have found
    validity_edge_remedies causes of edges, and remedies
    robustness_record      results as JSON

A walk is a sequence of values of one quantity in one direction. Quantities and the steps of walks are in
`interpreter.planning`.
"""

"""Robustness studies: each model is varied along each quantity to its validity edge, and every point is classified.

    robustness_study       all walks at once, in worker processes
    robustness_points      from values to a task and its key
    point_classification   from an outcome to one of nine classes
    reference_uncertainty  uncertainty of the reference
    task_queue             tasks and those who wait for their outcomes
    validity_maps          coarse grids over pairs of quantities
    validity_edges         edges that the walks have found
    validity_edge_remedies causes of edges, and remedies
    robustness_record      results as JSON

The quantities and the steps of a walk are in `interpreter.planning`.
"""

"""Studies: what many runs of one scene tell together.

    expansion/   from a study to tasks, each with a key that says when two are one
    workers/     processes that carry tasks out, and the journal that outlives them
    timing/      clocks that know when they were disturbed
    analysis/    what the points of a comparison tell: orders, fronts, advice
    stability/   walks to the edges of models
    compare      all of it for `dsl compare`

Imports rooms up to the run.
"""

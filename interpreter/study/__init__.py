"""Studies: many runs of one scene and their joint evaluation.

    configurations/    from a study to tasks, each with a key that identifies equal computations
    workers/           processes that perform tasks, and the journal of finished tasks
    timing/            timing that detects disturbances
    analysis/          evaluation of a comparison: orders of convergence, Pareto fronts, advice
    robustness/        parametric robustness studies up to the validity edges of models
    leaderboard/       models on all cases of a suite
    run_cache/         saved results of `dsl run`
    comparison_study   a whole comparison for `dsl compare`

Imports packages up to the pipeline.
"""

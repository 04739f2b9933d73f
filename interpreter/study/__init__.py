"""Studies: many runs of one scene, evaluated together.

    configurations/    variations of a scene, the tasks that compute them, and keys that identify equal computations
    workers/           processes that perform tasks, and the journal of finished tasks
    timing/            timing that detects disturbances
    analysis/          evaluation of a comparison: orders of convergence, Pareto fronts, advice
    robustness/        parametric robustness studies up to the validity edges of models
    leaderboard/       models on all cases of a suite
    run_cache/         saved results of `dsl run`
    comparison_study   a whole comparison for `dsl compare`

This package imports `interpreter.pipeline` and lower packages.
"""

"""Analysis of the points of a comparison: orders, limits, Pareto fronts, pairs, changes, advice.

`ComparedPoint.from_json` reads a configuration's result from a task or a file, `ComparisonRecord.from_json` a whole
comparison. Results are JSON records, written only by their `to_json`. To add a result: a class with its fields in the
order of the JSON, a function that computes it, and a field of `SceneAnalysis`.
"""

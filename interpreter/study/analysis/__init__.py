"""Analysis of a comparison: convergence orders, limits, Pareto fronts, pairs, changes and advice.

`ComparedPoint.from_json` reads the result of one configuration from a task or a file, `ComparisonRecord.from_json`
reads a whole comparison. Results are JSON records, written only by their method `to_json`. To add a result, write a
class with its fields in the order of the JSON, a function that computes it, and a field of `SceneAnalysis`.
"""

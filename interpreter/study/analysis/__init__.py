"""What the points of a comparison tell: orders, limits, fronts, pairs, changes, advice.

`ComparedPoint.from_json` reads what a task or a file says of a configuration, `Compared.from_json` a whole comparison;
what is found is `Plain`, and its `to_json` the only way back. To say one more thing: a class with its fields in the
order of the JSON, a function that finds it, and a field of `SceneAnalysis`.
"""

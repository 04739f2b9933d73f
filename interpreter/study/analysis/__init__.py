"""What the points of a comparison tell: orders, limits, fronts, pairs, changes, advice."""

"""Forces of a solution found once more, by formulas that share nothing with those that solved."""

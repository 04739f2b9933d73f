"""Leaderboard: every model on every case of a suite, computed and timed as by `dsl compare`.

suite_file             cases that a suite declares
suite_cases            cases together with their scenes
leaderboard_cells      leaderboard made from the results of a comparison
performance_profiles, model_strengths   evaluation of the leaderboard
leaderboard_changes    changes since another leaderboard
"""

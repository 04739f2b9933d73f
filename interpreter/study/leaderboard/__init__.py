"""Leaderboard: every model on every case of a suite, by the protocol of `dsl compare`.

suite_file             cases that a suite declares
suite_cases            cases together with their scenes
leaderboard_cells      the board of a comparison's results
performance_profiles, model_strengths   evaluation of the board
leaderboard_changes    changes since another board
"""

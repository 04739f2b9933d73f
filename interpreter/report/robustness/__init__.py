"""Page and terminal text of `dsl robustness`."""

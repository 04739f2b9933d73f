"""Page and terminal text of `dsl stress`."""

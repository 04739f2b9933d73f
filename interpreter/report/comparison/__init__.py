"""Page and terminal text of `dsl compare`."""

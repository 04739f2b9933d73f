"""The page and the terminal's text of `dsl compare`."""

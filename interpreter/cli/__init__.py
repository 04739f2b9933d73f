"""`dsl`: the command line, its commands a file each, the pages of `dsl explain`, signals. Nothing imports this room."""

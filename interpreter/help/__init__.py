"""What is said of every word and message of the language: by `dsl explain`, the editors and the pages."""

"""Explanations of every word and message of the language, for `dsl explain`, editors and the documentation."""

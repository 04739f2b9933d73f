"""A reader for each kind of file of results."""

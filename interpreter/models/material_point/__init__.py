"""One material point in place of a body: words, what supports and loads make of it, and what solves it."""

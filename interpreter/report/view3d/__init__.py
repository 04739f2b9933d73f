"""Views of bodies in three dimensions: surfaces reduced for a page, drawn as still pictures and interactively."""

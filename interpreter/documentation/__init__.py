"""Documentation of the language: written pages, pages generated from the vocabulary, and the builder of the site."""

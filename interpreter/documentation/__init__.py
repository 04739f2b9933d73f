"""The documentation: its pages, what of them is made from the words, and how they are built."""

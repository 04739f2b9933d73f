"""softmark from Python: what `import softmark` offers, and its arguments. Imports every room but `cli`."""

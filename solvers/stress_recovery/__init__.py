"""Stress and strain of a solid that was solved: at sampling points by its law, recovered to nodes, and as numbers."""

"""Notebook display of scenes, reports, comparisons and robustness studies, as pieces of HTML.

`box_frame.py` is shared by all. Each piece is readable without styles and scripts, needs no network and has a bounded
size. Scripts run in a frame of their own, so their names and styles do not affect the notebook.
"""

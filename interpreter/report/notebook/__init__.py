"""Notebook display of scenes, reports, comparisons and robustness studies, as HTML fragments.

All use `box_frame.py`. Each fragment is readable without styles and scripts, needs no network and has a bounded size.
Scripts run in a frame of their own, so that their names and styles do not affect the notebook.
"""

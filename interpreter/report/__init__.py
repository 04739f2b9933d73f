"""The report: pages that need nothing else, tables for the terminal, files for other programs.

    page       a document: its frame, markup, style sheets and scripts, which go into the page
    charts     axes, curves, colours, labels: SVG
    view3d     bodies in three dimensions; drawn without a script and with one
    run        the report of a run: `html.render`, `terminal`, a file for each section
    compare    the page of a comparison, and its table for the terminal
    stability  the page of where models end
    files      what is written beside the page

To add a section to a run: a file with `section_of(findings) -> str` ("" where it has nothing to show) in `run/tables`
or `run/figures`, and a line in `SECTIONS` of `run/report_page.py`.
"""

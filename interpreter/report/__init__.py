"""Reports: self-contained HTML pages, tables for the terminal, and files for other programs.

    page         HTML documents: markup, embedded CSV, style sheets and scripts
    charts       axes, curves, colours and labels as SVG
    view3d       bodies in three dimensions, as a still picture and interactive
    run          report of a run: `report_page.render`, `report_terminal.table`, and a file for each section
    comparison   page and terminal table of `dsl compare`
    robustness   page and terminal table of `dsl robustness`
    leaderboard  site of `dsl board`
    notebook     display of results in Jupyter notebooks
    exam_export  models and expected results for other programs
    files        JSON, HTML, JUnit and ParaView files

To add a section to the report of a run, write a file in `run/tables` or `run/figures` with a function
`section_of(findings) -> str`, which returns "" if there is nothing to show. Then add a line in `SECTIONS` of
`run/report_page.py`.
"""

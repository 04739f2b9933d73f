"""Report of a run of `dsl run`.

`report_page` orders the sections, `report_terminal` prints text, `report_summary` draws conclusions. To add a
section, write a file in `tables` or `figures` with a function `section_of(findings) -> str`, which returns "" if
there is nothing to show, and add a line in `report_page.SECTIONS`.
"""

"""Report of a run: `report_page` orders the sections, `report_terminal` prints text, `report_summary` draws
conclusions.

To add a section: one file in `tables` or `figures` with `section_of(findings) -> str` ("" if it has nothing to show),
one line in `report_page.SECTIONS`.
"""

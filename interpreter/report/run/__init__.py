"""The report of a run: `html` puts sections in order, `terminal` says it as text, `findings` what it comes to.

To add a section: one file in `tables` or `figures` with `section_of(findings) -> str` ("" where it has nothing to
show), one line in `html.SECTIONS`.
"""

"""The report as one HTML page that needs nothing else: `html.render(report)`, `files.write(report, folder)`.

What lives here: `html` puts the sections in order; `findings` reads the results and says what they come to;
`chart`, `axes`, `looks` and `plate` draw curves as SVG with a legend, a table and a CSV link; one file for
each section (`centre_lines`, `comparison`, `deviation`, `convergence`, `verdicts`, `listing`, `provenance`).
`terminal` is the same as text. `report.css` and `report.js` go into the page. To add a section: one file with
a function `section_of(findings) -> str` ("" where it has nothing to show), one line in `html.SECTIONS`.
"""

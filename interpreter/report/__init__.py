"""The report as one HTML page that needs nothing else: `html.render(report)`, and `files.write(report, folder)`.

What lives here: `html` puts the sections in order; `findings` reads the results and says what they come to;
`chart`, `axes`, `looks` and `plate` draw curves as SVG with a legend, a table and a CSV link; one file for
each section (`header`, `centre_lines`, `comparison`, `deviation`, `convergence`, `verdicts`, `listing`, `provenance`).
`report.css` and `report.js` are put into the page. To add a section: one file with a function
`section(report) -> str` ("" where it has nothing to show), one line in `html.SECTIONS`.
"""

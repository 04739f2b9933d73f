"""The report as one HTML page that needs nothing else: `html.render(report)`, `files.write(report, folder)`.

What lives here: `html` puts the sections in order; `findings` reads the results and says what they come to;
`chart`, `axes`, `looks` and `plate` draw curves as SVG with a legend, a table and a CSV link; one file for each
section (`shapes`, `centre_lines`, `comparison`, `published`, `histograms`, `deviation`, `realtime`, `histories`,
`refinement`, `convergence`, `verdicts`, `listing`, `provenance`). `bodies` tells which results are about one body,
`families` which models differ by size or Poisson's ratio alone, `camera` where gravity points. `surfaces` makes
shapes small enough for the page, `still` draws them without a script, `shapes.js` with one: `raster.js` paints
triangles, `shapes_controls.js` listens to the reader. `terminal` is the same as text, `vtk` writes files for
ParaView. The style sheets and scripts go into the page. To add a section: one file with a function
`section_of(findings) -> str` ("" where it has nothing to show), one line in `html.SECTIONS`.
"""

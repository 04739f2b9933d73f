"""Charts as SVG: axes, markers, colours, and labels that do not overlap."""

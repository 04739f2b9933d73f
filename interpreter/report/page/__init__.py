"""Building blocks of HTML pages: markup, style sheets, scripts, and figures with their data."""

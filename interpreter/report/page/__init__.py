"""What every page is made of: markup, style sheets and scripts, plates with tables."""

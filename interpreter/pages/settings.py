"""How Sphinx builds the pages: what would be `conf.py`, were there a folder with one."""

from __future__ import annotations

from typing import Any

from softmark import __version__

LIGHT = {
    "color-brand-primary": "#0a5a8c", "color-brand-content": "#0a5a8c", "color-background-primary": "#fbfaf7",
    "color-background-secondary": "#f3f1ec", "color-foreground-primary": "#1c2126", "color-foreground-secondary": "#56606b",
}  # fmt: skip
DARK = {
    "color-brand-primary": "#7dbfec", "color-brand-content": "#7dbfec", "color-background-primary": "#111519",
    "color-background-secondary": "#171c21", "color-foreground-primary": "#e5e8eb", "color-foreground-secondary": "#a5afb9",
}  # fmt: skip

SETTINGS: dict[str, Any] = {
    "project": "softmark",
    "author": "The softmark authors",
    "copyright": "The softmark authors, Apache-2.0",
    "version": __version__,
    "release": __version__,
    "language": "en",
    "extensions": ["myst_parser", "softmark.interpreter.pages.extension"],
    "myst_enable_extensions": ["attrs_block", "attrs_inline", "colon_fence", "deflist", "dollarmath"],
    "myst_heading_anchors": 3,
    "exclude_patterns": ["README.md"],
    "suppress_warnings": ["toc.empty_glob"],
    "nitpicky": True,  # a role that leads nowhere is a warning
    "html_theme": "furo",
    "html_title": f"softmark {__version__}",
    "html_theme_options": {"light_css_variables": LIGHT, "dark_css_variables": DARK},
    "html_static_path": ["_static"],
    "html_math_renderer": "mathml",
    "html_copy_source": False,
    "html_show_sourcelink": False,
    "html_show_sphinx": False,
    "html_show_search_summary": True,
    "html_permalinks_icon": "#",
    "pygments_style": "a11y-light",
    "highlight_language": "text",
}

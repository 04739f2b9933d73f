"""Sphinx settings of the documentation site; this module replaces a `conf.py`."""

from __future__ import annotations

from typing import Any

from softmark import __version__

NAMES = (
    "brand-primary", "brand-content", "background-primary", "background-secondary", "foreground-primary",
    "foreground-secondary",
)  # fmt: skip
COLOURS = {  # colours of the reports
    "light": ("#0a5a8c", "#0a5a8c", "#fbfaf7", "#f3f1ec", "#1c2126", "#56606b"),
    "dark": ("#7dbfec", "#7dbfec", "#111519", "#171c21", "#e5e8eb", "#a5afb9"),
}
THEME = {
    f"{scheme}_css_variables": {f"color-{name}": colour for name, colour in zip(NAMES, own, strict=True)}
    for scheme, own in COLOURS.items()
}

SETTINGS: dict[str, Any] = {
    "project": "softmark",
    "author": "The softmark authors",
    "copyright": "The softmark authors, Apache-2.0",
    "version": __version__,
    "release": __version__,
    "language": "en",
    "extensions": ["myst_parser", "softmark.interpreter.documentation.sphinx_extension"],
    "myst_enable_extensions": ["attrs_block", "attrs_inline", "colon_fence", "deflist", "dollarmath"],
    "myst_heading_anchors": 3,
    "myst_update_mathjax": False,
    "exclude_patterns": ["README.md"],
    "suppress_warnings": ["toc.empty_glob"],
    "nitpicky": True,  # a role without a target is a warning
    "html_theme": "furo",
    "html_title": f"softmark {__version__}",
    "html_theme_options": THEME,
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

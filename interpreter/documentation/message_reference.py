"""Reference pages of all diagnostics: the explanation pages of their codes, grouped by hundreds."""

from __future__ import annotations

import re

from softmark.interpreter.documentation.docstring_markdown import code_block
from softmark.interpreter.help.codes import Page
from softmark.interpreter.help.codes import pages as codes

FOLDER = "messages"
GROUPS = {  # name of a page: pattern of its codes, and its title
    "text": ("[EW]1", "1: the text"),
    "names": ("[EW]2", "2: names, units, dimensions"),
    "values": ("E3", "3: invalid values"),
    "doubts": ("W3", "3: warnings about values and answers"),
    "files": ("[EW]4", "4: files"),
    "models": ("[EW]5", "5: models and references"),
    "contact": ("[EW]6", "6: contact and studies"),
    "others": ("[EW]7", "7: results, plugins, other programs"),
}
FENCE = re.compile(r"^```(wrong|right)[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SIGN = "# Messages\n\nThe text that `dsl explain CODE` prints. An error, `E`, stops the run; `W` is a warning."


def pages() -> dict[str, str]:
    """Return the Markdown of every reference page, by file name."""
    tree = "\n".join(["```{toctree}", ":maxdepth: 1", "", *GROUPS, "```"])
    found = {f"{FOLDER}/{name}.md": _group(*group) for name, group in GROUPS.items()}
    return {f"{FOLDER}/index.md": f"{SIGN}\n\n{tree}\n", **found}


def _group(which: str, title: str) -> str:
    own = [page for code, page in codes().items() if re.match(which, code)]
    return "\n\n".join([f"# {title}", *(_section(page) for page in own)]) + "\n"


def _section(page: Page) -> str:
    """Return the explanation of a code as a section, with a scene that triggers the message and one that does not."""
    title, _, text = page.text.partition("\n")
    body = FENCE.sub(lambda m: f"*{m[1].capitalize()}*\n\n{_example(m[1], m[2])}", text.strip())
    return f"```{{message}} {page.code}\n```\n\n#{title}\n\n{body}"


def _example(which: str, scene: str) -> str:
    """Return a scene as highlighted code block; the highlighter accepts unknown words in a `wrong` scene."""
    return code_block("{code-block} scene", f":force:\n\n{scene}") if which == "wrong" else code_block("scene", scene)

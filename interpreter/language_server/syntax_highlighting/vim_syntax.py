"""Vim runtime folder: highlighting, and the settings of a buffer with a scene."""

from __future__ import annotations

import re
from pathlib import Path

from softmark.interpreter.language_server.syntax_highlighting.highlighted_words import words

TITLE = "syntax highlighting, comments and formatting for Vim"

DETECT = "autocmd BufNewFile,BufRead *.scene setfiletype scene\n"
SETTINGS = """\
if exists('b:did_ftplugin') | finish | endif
let b:did_ftplugin = 1
setlocal commentstring=#\\ %s comments=:# expandtab shiftwidth=4 softtabstop=4 suffixesadd=.scene
setlocal makeprg=dsl\\ check\\ % errorformat=%Eerror[E%n]:\\ %m,%Wwarning[W%n]:\\ %m,%Z\\ %#-->\\ %f:%l:%c,%-G%.%#
if executable('dsl') | setlocal formatprg=dsl\\ fmt\\ - | endif
"""


def files() -> dict[str, bytes]:
    """Return the files of a Vim runtime folder, by path."""
    return {
        "ftdetect/scene.vim": DETECT.encode(),
        "ftplugin/scene.vim": SETTINGS.encode(),
        "syntax/scene.vim": syntax().encode(),
    }


def install(folder: Path) -> str:
    """Return instructions on how to install the files from `folder` in Vim."""
    return f"cp -r {folder}/. ~/.vim/\n`:make` then checks the scene, and `gqG` from its first line formats it."


def syntax() -> str:
    """Return the highlighting rules; words of a role are matched by position, since any of them may also be a name."""
    own = words()
    reserved = "|".join(own.reserved)
    factor = r"(\%|°?[[:alpha:]µμ]\w*)(\^[+-]?\d+(\.\d+)?)?"
    quantity = r"(<\d+(\.\.@!\d*)?|\.@1<!\.\d+)([eE][+-]?\d+)?"
    unit = rf"(<({reserved})>)@!{factor}([*/·](\([^)]*\)|{factor})\w@!\(@!)*"
    unit = re.sub(r"(?<!\\)\(", "%(", unit)  # Vim allows at most nine capturing groups, and none is needed
    lines = [
        "if exists('b:current_syntax') | finish | endif",
        f"syn keyword sceneReserved {' '.join(own.reserved)}",
        f"syn match sceneConstant '\\v\\.@1<!<({'|'.join(own.constants)})>(\\.\\w)@!'",
        f"syn match sceneCall '\\v<{_NAME}\\ze\\('",
        f"syn match sceneFunction '\\v<({'|'.join(own.functions)})\\ze\\('",
        f"syn match sceneConstructor '\\v<({'|'.join(own.constructors)})\\ze\\('",
        f"syn match sceneField '\\v<{_NAME}\\ze\\s*\\=\\=@!'",
        f"syn match sceneKind '\\v^\\s*\\zs({'|'.join(own.kinds)})\\ze\\s+{_NAME}\\s*\\=' "
        "nextgroup=sceneName skipwhite",
        f"syn match sceneName '\\v<{_NAME}' contained",
        f"syn match sceneNumber '\\v{quantity}' nextgroup=sceneUnit skipwhite",
        "syn match sceneBracket '[])]' nextgroup=sceneUnit skipwhite",
        f"syn match sceneUnit '\\v{unit}' contained",
        "syn region sceneText start='\"' skip='\\\\\"' end='\"' oneline",
        "syn match sceneComment '#.*$' contains=@Spell",
    ]
    lines += [f"hi def link scene{name} {group}" for name, group in LINKS.items()]
    return "\n".join([*lines, "let b:current_syntax = 'scene'", ""])


_NAME = r"\h\w*"
LINKS = {
    "Reserved": "Keyword", "Field": "Identifier", "Constant": "Constant", "Call": "Function", "Function": "Function",
    "Constructor": "Structure", "Kind": "Type", "Name": "Identifier", "Number": "Number", "Unit": "Special",
    "Text": "String", "Comment": "Comment",
}  # fmt: skip

"""Colours and settings for editors, made of the vocabulary when they are asked for: by `dsl editor`, and by Pygments.

`EDITORS` has a module for each editor. One has `TITLE`, `files()`, what is written by name, and `install(folder)`, what
to do with it. To add an editor: its module, and a line here.
"""

EDITORS = {
    "vscode": "vscode_extension",
    "vim": "vim_syntax",
    "neovim": "neovim_files",
    "emacs": "emacs_mode",
    "kate": "kate_syntax",
    "textmate": "textmate_grammar",
    "tree-sitter": "tree_sitter_grammar",
}

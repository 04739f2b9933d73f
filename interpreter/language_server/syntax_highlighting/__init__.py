"""Syntax highlighting and settings for editors and Pygments, generated from the vocabulary for `dsl editor`.

`EDITORS` has a module for each editor, with its `TITLE`, `files()` (contents by file name) and `install(folder)`
(installation instructions). To add an editor: write its module, and a line here.
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

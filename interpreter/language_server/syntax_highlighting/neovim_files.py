"""Neovim runtime folder: the files of Vim, and the language server."""

from __future__ import annotations

from pathlib import Path

from softmark.interpreter.language_server.syntax_highlighting import vim_syntax

TITLE = "the files of Vim and the language server for Neovim"

SERVER = """\
-- Neovim 0.11 and later: vim.lsp.enable('softmark')
return {
  cmd = { 'dsl', 'lsp' },
  filetypes = { 'scene' },
  root_markers = { '.git' },
}
"""
START = """\
-- Starts the language server of softmark with every scene, in every Neovim that has one.
vim.api.nvim_create_autocmd('FileType', {
  pattern = 'scene',
  callback = function(args)
    if vim.fn.executable('dsl') == 0 then return end
    if vim.lsp.enable then
      vim.lsp.enable('softmark')
    elseif vim.lsp.start then
      vim.lsp.start({ name = 'softmark', cmd = { 'dsl', 'lsp' }, root_dir = vim.fn.fnamemodify(args.file, ':p:h') })
    end
  end,
})
"""


def files() -> dict[str, bytes]:
    """Return the files of a Neovim runtime folder, by path."""
    return {**vim_syntax.files(), "lsp/softmark.lua": SERVER.encode(), "plugin/softmark.lua": START.encode()}


def install(folder: Path) -> str:
    """Return instructions on how to install the files from `folder` in Neovim."""
    return f'cp -r {folder}/. ~/.config/nvim/\nThe language server is that of `dsl`: pip install "softmark[lsp]"'

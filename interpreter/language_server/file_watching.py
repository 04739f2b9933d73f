"""What changes while scenes are open: settings, reports, whose numbers stand beside lines, used scenes, and plugins.

An editor that can be asked to tells of them (`workspace/didChangeWatchedFiles`); another shows what is new after the
next change of the text.
"""

from __future__ import annotations

from lsprotocol import types

from softmark.interpreter.language.scene_sources import SUFFIX
from softmark.interpreter.language_server import editor_plugins
from softmark.interpreter.language_server.open_documents import Opened

WATCHED = ("**/report.json", f"**/*{SUFFIX}", f"**/*{editor_plugins.SUFFIX}")


def watch(opened: Opened, params: types.InitializedParams) -> None:
    """Ask an editor to tell of changes, where it lets itself be asked."""
    can = opened.server.client_capabilities.workspace
    if can is None or can.did_change_watched_files is None or not can.did_change_watched_files.dynamic_registration:
        return
    method = types.WORKSPACE_DID_CHANGE_WATCHED_FILES
    options = types.DidChangeWatchedFilesRegistrationOptions([types.FileSystemWatcher(glob) for glob in WATCHED])
    asked = types.Registration("softmark-files", method, options)
    opened.server.client_register_capability(types.RegistrationParams([asked]))


def saved(opened: Opened, params: types.DidSaveTextDocumentParams) -> None:
    """Look again at a scene that is written to its file: at meshes, tables and plugins as well, wherever they are."""
    opened.plugins.load()
    opened.again(params.text_document.uri)


def changed(opened: Opened, params: types.DidChangeWatchedFilesParams) -> None:
    """Look again at what lies in files: of scenes that are open anew, and at the numbers beside their lines."""
    if opened.plugins.has([change.uri for change in params.changes]):
        opened.plugins.load()
    if any(change.uri.endswith(SUFFIX) for change in params.changes):
        for uri in list(opened.documents):
            opened.again(uri)
    can = opened.server.client_capabilities.workspace
    if can is not None and can.inlay_hint is not None and can.inlay_hint.refresh_support:
        opened.server.workspace_inlay_hint_refresh(None)


def configured(opened: Opened, params: types.DidChangeConfigurationParams) -> None:
    """Settings have changed, which may name other plugins."""
    opened.plugins.configure(params.settings)
    opened.plugins.load()

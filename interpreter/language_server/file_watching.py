"""Reaction to changes while scenes are open: of settings, displayed reports, used scenes and plugins.

An editor that supports it reports changed files (`workspace/didChangeWatchedFiles`). With other editors, changes take
effect after the next edit of the text.
"""

from __future__ import annotations

from lsprotocol import types

from softmark.interpreter.language.scene_sources import SUFFIX
from softmark.interpreter.language_server import editor_plugins
from softmark.interpreter.language_server.open_documents import OpenDocuments

WATCHED = ("**/report.json", f"**/*{SUFFIX}", f"**/*{editor_plugins.SUFFIX}")


def watch(opened: OpenDocuments, params: types.InitializedParams) -> None:
    """Ask the editor to report file changes, if it supports this."""
    can = opened.server.client_capabilities.workspace
    if can is None or can.did_change_watched_files is None or not can.did_change_watched_files.dynamic_registration:
        return
    method = types.WORKSPACE_DID_CHANGE_WATCHED_FILES
    options = types.DidChangeWatchedFilesRegistrationOptions([types.FileSystemWatcher(glob) for glob in WATCHED])
    asked = types.Registration("softmark-files", method, options)
    opened.server.client_register_capability(types.RegistrationParams([asked]))


def handle_save(opened: OpenDocuments, params: types.DidSaveTextDocumentParams) -> None:
    """Check a saved scene again, including the meshes, tables and plugins that it uses."""
    opened.plugins.load()
    opened.again(params.text_document.uri)


def handle_file_changes(opened: OpenDocuments, params: types.DidChangeWatchedFilesParams) -> None:
    """Check open scenes again after changes of files, and refresh the results shown at the ends of their lines."""
    if opened.plugins.has([change.uri for change in params.changes]):
        opened.plugins.load()
    if any(change.uri.endswith(SUFFIX) for change in params.changes):
        for uri in list(opened.documents):
            opened.again(uri)
    can = opened.server.client_capabilities.workspace
    if can is not None and can.inlay_hint is not None and can.inlay_hint.refresh_support:
        opened.server.workspace_inlay_hint_refresh(None)


def handle_settings(opened: OpenDocuments, params: types.DidChangeConfigurationParams) -> None:
    """Apply changed settings, which may name other plugins."""
    opened.plugins.configure(params.settings)
    opened.plugins.load()

"""Completion candidates for files, folders and plugins."""

from __future__ import annotations

import os


def files(current: str, *endings: str) -> dict[str, str]:
    """Return paths that begin with `current`, as keys with empty descriptions.

    These are files with one of the `endings`, and folders, which end with `/`.
    """
    folder, name = os.path.split(current)
    found = {}
    try:
        entries = sorted(os.scandir(os.path.expanduser(folder) or "."), key=lambda entry: entry.name)
    except OSError:
        return {}
    for entry in entries:
        hidden = entry.name.startswith(".") and not name.startswith(".")
        if hidden or not entry.name.startswith(name):
            continue
        if entry.is_dir():
            found[f"{os.path.join(folder, entry.name)}/"] = ""
        elif entry.name.endswith(endings):
            found[os.path.join(folder, entry.name)] = ""
    return found


def folders(current: str) -> dict[str, str]:
    """Return folders whose path begins with `current`."""
    return {name: "" for name in files(current) if name.endswith("/")}


def plugins(current: str) -> dict[str, str]:
    """Return installed plugins with their modules, and Python files whose path begins with `current`."""
    from importlib.metadata import entry_points

    installed = {point.name: point.module for point in entry_points(group="softmark.plugins")}
    return {**installed, **files(current, ".py")}

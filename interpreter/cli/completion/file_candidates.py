"""Files, folders and plugins that a word could name."""

from __future__ import annotations

import os


def files(current: str, *endings: str) -> dict[str, str]:
    """Files with one of some endings that begin as a word does, and folders, which end with a `/`."""
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
    """Folders alone."""
    return {name: "" for name in files(current) if name.endswith("/")}


def plugins(current: str) -> dict[str, str]:
    """Plugins that are installed, by their names, and files that could be one."""
    from importlib.metadata import entry_points

    installed = {point.name: point.module for point in entry_points(group="softmark.plugins")}
    return {**installed, **files(current, ".py")}

"""The folder of what is kept: a file for each key, written whole or not at all, and checked before it is believed.

A file is a line with its schema and the user's authentication code of its key and all that follows, then an archive of
arrays (`npz`, without objects) among which is the JSON. What cannot be read, or was not written by this user under this
key, is damaged, and counts as not there: a folder that came with somebody else's scene decides nothing, and neither do
files that have changed their names.
"""

from __future__ import annotations

import io
import json
import os
import shutil
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from softmark.interpreter.results.atomic_files import folder_within, replace
from softmark.interpreter.results.result_authentication import code_of, is_authentic
from softmark.interpreter.study.run_cache.run_cache_keys import SCHEMA
from softmark.safe_files import read_regular

FOLDER = "kept"  # in that of the report
SUFFIX = ".kept"
MOST, LARGEST = 400, 400 << 20  # files and bytes of a folder
RESERVE = 256 << 20  # bytes of the disk that are left for reports


class Damaged(Exception):
    """A file that is not what was written; the text names it."""


def read(folder: Path, key: str) -> tuple[Any, Mapping[int, np.ndarray]] | None:
    """The JSON and the arrays of a key; None where there is nothing. Raises Damaged."""
    path = _path(folder, key)
    try:
        data = read_regular(path, LARGEST) if _is_own(folder) else b""
    except FileNotFoundError:
        return None
    except OSError as error:
        raise Damaged(f"{path} cannot be read ({error.strerror})") from error
    head, _, body = data.partition(b"\n")
    schema, _, code = head.decode("ascii", errors="replace").partition(" ")
    if schema != SCHEMA or not is_authentic(_purpose(key), body, code):
        raise Damaged(f"{path} is damaged, renamed, or not of a run of yours")
    try:
        with np.load(io.BytesIO(body), allow_pickle=False) as archive:
            arrays = {int(n): archive[n] for n in archive.files if n != "json"}
            value = json.loads(archive["json"].tobytes())
    except Exception as error:
        raise Damaged(f"{path} is damaged") from error
    with suppress(OSError):
        os.utime(path)  # what is used stays longest
    return value, arrays


def write(folder: Path, key: str, value: Any, arrays: Sequence[np.ndarray]) -> None:
    """Keep the JSON and the arrays of a key. Raises OSError."""
    text = np.frombuffer(json.dumps(value).encode(), dtype=np.uint8)
    body = io.BytesIO()
    named: dict[str, Any] = {str(i): a for i, a in enumerate(arrays)}
    np.savez(body, json=text, **named)  # of numbers: nothing is pickled
    folder_within(folder.parent, folder.name)
    if shutil.disk_usage(folder).free < RESERVE + len(body.getvalue()):
        raise OSError(None, f"less than {RESERVE >> 20} MiB of the disk would be left for reports")
    replace(_path(folder, key), _head(key, body.getvalue()) + b"\n" + body.getvalue())


def prune(folder: Path, used: Collection[str]) -> None:
    """Take away what was not used for longest, until the folder holds no more than it may; of `used` keys nothing."""
    if not _is_own(folder):
        return
    own = {_path(folder, key) for key in used}
    found = sorted(((*_age(p), p) for p in folder.glob(f"*{SUFFIX}") if p not in own), reverse=True)
    room, count = LARGEST - sum(_age(p)[1] for p in own), MOST - len(own)
    for _, size, path in found:
        room, count = room - size, count - 1
        if room < 0 or count < 0:
            with suppress(OSError):  # another run was faster
                path.unlink()


def _age(path: Path) -> tuple[int, int]:
    """When it was last used, ns, and its size."""
    try:
        found = path.stat()
    except OSError:
        return 0, 0
    return found.st_mtime_ns, found.st_size


def _is_own(folder: Path) -> bool:
    """Return whether the folder is no symbolic link: through one, nothing is read, written or removed."""
    return not folder.is_symlink()


def _path(folder: Path, key: str) -> Path:
    return folder / f"{key}{SUFFIX}"


def _head(key: str, body: bytes) -> bytes:
    return f"{SCHEMA} {code_of(_purpose(key), body)}".encode()


def _purpose(key: str) -> str:
    """Return what the authentication code of a file is for: the result of this key and of no other."""
    return f"{SCHEMA} {key}"

"""Folder of saved results, with one file for each key, written atomically and checked before use.

A file begins with a line that contains its schema and the user's authentication code of its key and its contents. Then
follows an archive of arrays (`npz`, without objects) that includes the JSON. A file that cannot be read, or that was
not written by this user under this key, counts as damaged and is ignored. So a folder that came with a foreign scene
has no effect, and neither have renamed files.
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

from softmark.interpreter.results.atomic_files import make_inner_folder, replace
from softmark.interpreter.results.result_authentication import code_of, is_authentic
from softmark.interpreter.study.run_cache.run_cache_keys import SCHEMA
from softmark.safe_files import read_regular

FOLDER = "kept"  # inside the report's folder
SUFFIX = ".kept"
MOST, LARGEST = 400, 400 << 20  # maximum number of files and bytes of a folder
RESERVE = 256 << 20  # bytes of the disk that stay free


class DamagedFile(Exception):
    """Error: a saved file differs from what was written. The text names the file."""


def read_saved(folder: Path, key: str) -> tuple[Any, Mapping[int, np.ndarray]] | None:
    """Read the JSON value and the arrays, by index, saved under a key. Raises DamagedFile.

    Return None if there is no file.
    """
    path = _path(folder, key)
    try:
        data = read_regular(path, LARGEST) if _is_not_symlink(folder) else b""
    except FileNotFoundError:
        return None
    except OSError as error:
        raise DamagedFile(f"{path} cannot be read ({error.strerror})") from error
    head, _, body = data.partition(b"\n")
    schema, _, code = head.decode("ascii", errors="replace").partition(" ")
    if schema != SCHEMA or not is_authentic(_authentication_purpose(key), body, code):
        raise DamagedFile(f"{path} is damaged, renamed, or was not written by your own run")
    try:
        with np.load(io.BytesIO(body), allow_pickle=False) as archive:
            arrays = {int(n): archive[n] for n in archive.files if n != "json"}
            value = json.loads(archive["json"].tobytes())
    except Exception as error:
        raise DamagedFile(f"{path} is damaged") from error
    with suppress(OSError):
        os.utime(path)  # a use renews its date
    return value, arrays


def write_saved(folder: Path, key: str, value: Any, arrays: Sequence[np.ndarray]) -> None:
    """Save a JSON value and its arrays under a key. Raises OSError."""
    text = np.frombuffer(json.dumps(value).encode(), dtype=np.uint8)
    body = io.BytesIO()
    named: dict[str, Any] = {str(i): a for i, a in enumerate(arrays)}
    np.savez(body, json=text, **named)  # only numbers: nothing is pickled
    make_inner_folder(folder.parent, folder.name)
    if shutil.disk_usage(folder).free < RESERVE + len(body.getvalue()):
        raise OSError(None, f"less than {RESERVE >> 20} MiB of disk space would remain for reports")
    replace(_path(folder, key), _authentication_header(key, body.getvalue()) + b"\n" + body.getvalue())


def prune_folder(folder: Path, used: Collection[str]) -> None:
    """Remove the least recently used files until the folder is within its limits; files of `used` keys are kept."""
    if not _is_not_symlink(folder):
        return
    own = {_path(folder, key) for key in used}
    found = sorted(((*_last_use_and_size(p), p) for p in folder.glob(f"*{SUFFIX}") if p not in own), reverse=True)
    room, count = LARGEST - sum(_last_use_and_size(p)[1] for p in own), MOST - len(own)
    for _, size, path in found:
        room, count = room - size, count - 1
        if room < 0 or count < 0:
            with suppress(OSError):  # another run has removed it
                path.unlink()


def _last_use_and_size(path: Path) -> tuple[int, int]:
    """Return the time of the last use of a file, ns, and its size, bytes."""
    try:
        found = path.stat()
    except OSError:
        return 0, 0
    return found.st_mtime_ns, found.st_size


def _is_not_symlink(folder: Path) -> bool:
    """Return whether the folder is not a symbolic link; through a link nothing is read, written or removed."""
    return not folder.is_symlink()


def _path(folder: Path, key: str) -> Path:
    return folder / f"{key}{SUFFIX}"


def _authentication_header(key: str, body: bytes) -> bytes:
    return f"{SCHEMA} {code_of(_authentication_purpose(key), body)}".encode()


def _authentication_purpose(key: str) -> str:
    """Return the text that binds the authentication code of a file to its key."""
    return f"{SCHEMA} {key}"

"""The folder of what is kept: a file for each key, written whole or not at all, and checked before it is believed.

A file is a line with its schema and the SHA-256 of all that follows, then an archive of arrays (`npz`, without objects)
among which is the JSON. What cannot be read, or is not what it says, is damaged, and counts as not there.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from softmark.interpreter.results.files import replace
from softmark.interpreter.study.kept.keys import SCHEMA

FOLDER = "kept"  # in that of the report
SUFFIX = ".kept"
MOST, LARGEST = 400, 400 << 20  # files and bytes of a folder


class Damaged(Exception):
    """A file that is not what was written; the text names it."""


def read(folder: Path, key: str) -> tuple[Any, Mapping[int, np.ndarray]] | None:
    """The JSON and the arrays of a key; None where there is nothing. Raises Damaged."""
    path = _path(folder, key)
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise Damaged(f"{path} cannot be read ({error.strerror})") from error
    head, _, body = data.partition(b"\n")
    if head != _head(body):
        raise Damaged(f"{path} is damaged")
    try:
        with np.load(io.BytesIO(body), allow_pickle=False) as archive:
            arrays = {int(n): archive[n] for n in archive.files if n != "json"}
            own = json.loads(archive["json"].tobytes())
    except Exception as error:
        raise Damaged(f"{path} is damaged") from error
    if own.get("key") != key:
        raise Damaged(f"{path} is of another result")
    with suppress(OSError):
        os.utime(path)  # what is used stays longest
    return own["value"], arrays


def write(folder: Path, key: str, value: Any, arrays: Sequence[np.ndarray]) -> None:
    """Keep the JSON and the arrays of a key. Raises OSError."""
    text = np.frombuffer(json.dumps({"key": key, "value": value}).encode(), dtype=np.uint8)
    body = io.BytesIO()
    named: dict[str, Any] = {str(i): a for i, a in enumerate(arrays)}
    np.savez(body, json=text, **named)  # of numbers: nothing is pickled
    folder.mkdir(parents=True, exist_ok=True)
    replace(_path(folder, key), _head(body.getvalue()) + b"\n" + body.getvalue())


def prune(folder: Path, used: Collection[str]) -> None:
    """Take away what was not used for longest, until the folder holds no more than it may; of `used` keys nothing."""
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


def _path(folder: Path, key: str) -> Path:
    return folder / f"{key}{SUFFIX}"


def _head(body: bytes) -> bytes:
    return f"{SCHEMA} {hashlib.sha256(body).hexdigest()}".encode()

"""Authentication of saved results that a later run reuses, by HMAC-SHA-256 with a private key of the user.

A folder from someone else may contain forged results, which would decide what the next run reports. Results without the
authentication code of this user are computed again. The key is stored only in the user's cache folder; without such a
folder a process trusts only its own results.
Source: RFC 2104.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import secrets
import stat
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path

NAME = "results.key"  # in the user's cache folder of softmark
SIZE = 32  # bytes of the key


def code_of(purpose: str, data: bytes) -> str:
    """Return the authentication code of data for a purpose, as hexadecimal digits; a missing key is created."""
    return _compute_code(_read_key() or _make_key() or _temporary_key(), purpose, data)


def is_authentic(purpose: str, data: bytes, code: str) -> bool:
    """Return whether `code` is the authentication code of this user for the data and the purpose."""
    known = _compute_code(_read_key() or _temporary_key(), purpose, data)
    return hmac.compare_digest(known.encode(), code.encode(errors="replace"))


def _compute_code(key: bytes, purpose: str, data: bytes) -> str:
    return hmac.new(key, purpose.encode() + b"\0" + data, hashlib.sha256).hexdigest()


def key_file() -> Path | None:
    """Return the path of the key file; None if there is no absolute home or cache folder."""
    root = os.environ.get("XDG_CACHE_HOME", "")
    if not os.path.isabs(root):
        root = os.path.join(os.path.expanduser("~"), ".cache")
    return Path(root) / "softmark" / NAME if os.path.isabs(root) else None


def _read_key() -> bytes | None:
    """Return the key; None unless its file belongs to this user and nobody else may read or write it."""
    file = key_file()
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0)
    if file is None:
        return None
    try:
        descriptor = os.open(file, flags)
    except OSError:
        return None
    with os.fdopen(descriptor, "rb") as opened:
        known = os.fstat(descriptor)
        own = not hasattr(os, "getuid") or known.st_uid == os.getuid()
        if not stat.S_ISREG(known.st_mode) or not own or known.st_mode & 0o077:
            return None
        key = opened.read(SIZE + 1)
    return key if len(key) == SIZE else None


def _make_key() -> bytes | None:
    """Create a key file and return its key; None if no file can be written.

    If another process created the file at the same time, its key is returned.
    """
    file = key_file()
    if file is None:
        return None
    with suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        handle, part = tempfile.mkstemp(dir=file.parent, prefix=".part-")  # for the owner only
        try:
            with os.fdopen(handle, "wb") as opened:
                opened.write(secrets.token_bytes(SIZE))
            if file.is_symlink() or file.exists():  # an existing file is not this user's key
                os.replace(part, file)
            else:
                with suppress(FileExistsError):
                    os.link(part, file)  # unlike a rename, it overwrites nothing
        finally:
            Path(part).unlink(missing_ok=True)
    return _read_key()


@cache
def _temporary_key() -> bytes:
    """Return a random key that is not stored and lasts only for this process."""
    return secrets.token_bytes(SIZE)

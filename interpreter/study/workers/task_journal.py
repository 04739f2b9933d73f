"""Journal of finished tasks on disk, written line by line, so that a killed process loses no finished task.

A line is one JSON object, written by one call and synced to disk. The first line identifies the journal. Every other
line has a `kind`, the `key` of a configuration and the number `repeat`, which together are unique. If a power failure
left the last line incomplete, it is ignored, and removed before anything is appended. Every entry ends with `hmac`, the
authentication code of the user who wrote it. An entry without a valid code, as in a journal that came with a foreign
scene, is ignored.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Any, Self

from softmark.interpreter.results.atomic_files import replace
from softmark.interpreter.results.result_authentication import code_of, is_authentic

SCHEMA = "softmark-journal/1"
NAME, LOCK = "journal.jsonl", "journal.lock"
CODE = "hmac"  # the last member of an entry

Json = dict[str, Any]
Identity = tuple[str, str, int]  # kind, key, repeat


class JournalRefused(Exception):
    """Error: a folder cannot be used for this study. The text gives the reason and the remedy."""


class Interrupted(KeyboardInterrupt):
    """Error: a study was interrupted. The text says which results are on disk."""


def identity(entry: Json) -> Identity:
    """Return the identity (kind, key, repeat) of a journal entry."""
    return str(entry["kind"]), str(entry["key"]), int(entry.get("repeat", 0))


@dataclass
class Journal:
    """Open journal, locked against other processes; use it as a context, or close it."""

    path: Path
    entries: dict[Identity, Json] = field(default_factory=dict)
    foreign: int = 0  # entries that this user's runs did not write
    _file: int = -1
    _lock: int = -1

    @classmethod
    def open(cls, folder: Path, fresh: bool = False) -> Journal:
        """Open the journal of a folder, creating it if necessary. Raises JournalRefused, OSError.

        With `fresh` all entries are removed.
        """
        folder.mkdir(parents=True, exist_ok=True)
        journal = cls(folder / NAME)
        journal._lock = _lock_journal(folder / LOCK)
        try:
            journal._open_and_load(fresh)
        except BaseException:
            journal.close()
            raise
        return journal

    def _open_and_load(self, fresh: bool) -> None:
        data = b"" if fresh else _read_journal_bytes(self.path)
        whole = data[: data.rfind(b"\n") + 1]  # an incomplete last line
        lines = list(_parse_lines(whole))
        if whole and not lines:
            raise JournalRefused(
                f"{self.path} is not a journal; replace it with `--fresh`, or choose another folder with `--out`"
            )
        if lines and lines[0].get("schema") != SCHEMA:
            found = str(lines[0].get("schema", "not a softmark journal"))[:80]
            raise JournalRefused(
                f"{self.path} is {found}, not {SCHEMA}; start a new one with `--fresh`, or choose another folder "
                f"with `--out`"
            )
        for entry in lines[1:]:
            if not _has_identity(entry):
                continue
            if _pop_authentic_code(entry):
                self.entries.setdefault(identity(entry), entry)
            else:
                self.foreign += 1
        if fresh:
            replace(self.path, "")  # a new file: a hard link or symbolic link keeps its target unchanged
        self._file = _open_journal(self.path, os.O_RDWR | os.O_APPEND)
        os.ftruncate(self._file, len(whole) if lines else 0)
        if not lines:
            self.entries.clear()
            self._write({"schema": SCHEMA})

    @property
    def remark(self) -> str:
        """Note on entries that runs of this user did not write and that are ignored; empty if there are none."""
        if not self.foreign:
            return ""
        count = f"{self.foreign} entr{'y' if self.foreign == 1 else 'ies'} of {self.path}"
        return f"{count} not written by your own runs: recomputed"

    def add(self, entry: Json) -> bool:
        """Append an entry and sync the file; return whether it was new. Raises OSError.

        An entry whose identity exists already is not written.
        """
        name = identity(entry)
        if name in self.entries:
            return False
        self._write(entry)
        self.entries[name] = entry
        return True

    def append(self, kind: str, key: str, **said: Any) -> None:
        """Append an entry of a kind and a key, with the next repeat number. Raises OSError."""
        repeat = next(i for i in count() if (kind, key, i) not in self.entries)
        self.add({"kind": kind, "key": key, "repeat": repeat, **said})

    def _write(self, entry: Json) -> None:
        told = entry if "schema" in entry else {**entry, CODE: code_of(SCHEMA, _serialize_entry(entry))}
        data = _serialize_entry(told) + b"\n"
        if os.write(self._file, data) != len(data):
            raise OSError(None, "the journal could not be written completely; the disk may be full")
        os.fsync(self._file)

    def of_kind(self, kind: str) -> dict[str, Json]:
        """Return the entries of a kind by key; if there are repeats, only the last."""
        return {key: entry for (own, key, _), entry in self.entries.items() if own == kind}

    def on_disk(self, kind: str) -> set[str]:
        """Return the keys of all entries of a kind in the file.

        After an interruption the file may have entries that this process does not know.
        """
        data = _read_journal_bytes(self.path)
        lines = _parse_lines(data[: data.rfind(b"\n") + 1])
        return {
            str(line["key"])
            for line in lines
            if line.get("kind") == kind and "key" in line and _pop_authentic_code(line)
        }

    def close(self) -> None:
        """Close the file and release the lock."""
        for descriptor in (self._file, self._lock):
            if descriptor >= 0:
                os.close(descriptor)
        self._file = self._lock = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def _has_identity(entry: Json) -> bool:
    """Return whether an entry has a kind, a key and a repeat number."""
    named = isinstance(entry.get("kind"), str) and isinstance(entry.get("key"), str)
    return named and type(entry.get("repeat", 0)) is int


def _pop_authentic_code(entry: Json) -> bool:
    """Remove the authentication code from an entry, and return whether it is a valid code of this user."""
    code = entry.pop(CODE, "")
    try:
        return is_authentic(SCHEMA, _serialize_entry(entry), str(code))
    except ValueError:  # numbers that are none, which are never written
        return False


def _serialize_entry(entry: Json) -> bytes:
    text = json.dumps(entry, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return text.encode(errors="surrogatepass")


def _read_journal_bytes(path: Path) -> bytes:
    """Return the bytes of a journal file, empty if there is no file. Raises JournalRefused, OSError."""
    try:
        descriptor = _open_journal(path, os.O_RDONLY)
    except FileNotFoundError:
        return b""
    with os.fdopen(descriptor, "rb") as file:
        return file.read()


def _open_journal(path: Path, flags: int) -> int:
    """Open a regular file and return its descriptor. Raises JournalRefused if it is not a regular file.

    A file to be written is created. Symbolic links are never followed.
    """
    careful = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0)
    if path.is_symlink() or (path.exists() and not path.is_file()):
        what = "a symbolic link" if path.is_symlink() else "not a regular file"
        raise JournalRefused(f"{path} is {what}; remove it, or choose another folder with `--out`")
    return os.open(path, flags | careful | (0 if flags == os.O_RDONLY else os.O_CREAT), 0o644)


def _parse_lines(data: bytes) -> Iterator[Json]:
    """Yield the JSON objects in complete lines; unreadable lines are ignored."""
    for line in data.splitlines():
        if not line.startswith(b"{"):
            continue
        try:
            found = json.loads(line)
        except (ValueError, RecursionError):
            continue
        if isinstance(found, dict):
            yield found


def _lock_journal(path: Path) -> int:
    """Take an exclusive lock and return its descriptor. Raises JournalRefused if another process has it.

    The system releases the lock when this process ends in any way.
    """
    import fcntl

    descriptor = _open_journal(path, os.O_RDWR)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(descriptor)
        raise JournalRefused(
            f"another comparison is running in {path.parent}; wait for it, or choose another folder with `--out`"
        ) from error
    return descriptor

"""Launcher that sets limits and then becomes the program: a script run by its path, with no imports of softmark.

    python -I -S limited_launcher.py PARENT FILE MEMORY CPU COMMAND...
The limits are bytes of a file and of address space, and s of CPU time, by setrlimit(2); no core dumps. On Linux the
program is killed when PARENT ends for any reason: prctl(2) preserves that over execve(2).
"""

from __future__ import annotations

import os
import resource
import signal
import sys

PR_SET_PDEATHSIG = 1
MISSING = 127  # as of a shell


def main() -> None:
    """Set the limits, and replace this process by the program."""
    parent, file, memory, cpu, *command = sys.argv[1:]
    _die_with(int(parent))
    limit(resource.RLIMIT_CORE, 0)
    limit(resource.RLIMIT_FSIZE, int(file))
    limit(resource.RLIMIT_CPU, int(cpu))
    limit(resource.RLIMIT_AS, int(memory))
    try:
        os.execvp(command[0], command)
    except OSError as error:
        sys.stderr.write(f"{command[0]}: {error.strerror}\n")
        os._exit(MISSING)


def limit(which: int, asked: int) -> None:
    """Set a limit, or our own limit if that is lower, because only root may raise it."""
    _, own = resource.getrlimit(which)
    least = asked if own == resource.RLIM_INFINITY else min(asked, own)
    resource.setrlimit(which, (least, least))


def _die_with(parent: int) -> None:
    if not sys.platform.startswith("linux"):
        return
    import ctypes

    ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it went before this stood
        os._exit(1)


if __name__ == "__main__":
    main()

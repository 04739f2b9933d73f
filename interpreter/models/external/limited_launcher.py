"""Launcher that sets resource limits and then replaces itself by the program: a script that imports no softmark.

    python -I -S limited_launcher.py PARENT FILE MEMORY CPU COMMAND...
FILE and MEMORY are limits in bytes of file size and address space, CPU one in seconds of CPU time, set by setrlimit(2);
there are no core dumps. On Linux the program is killed when the process PARENT ends for any reason: prctl(2) preserves
that setting over execve(2).
"""

from __future__ import annotations

import os
import resource
import signal
import sys

PR_SET_PDEATHSIG = 1
MISSING = 127  # exit status of a missing program, as in a shell


def main() -> None:
    """Set the limits, and replace this process by the program."""
    parent, file, memory, cpu, *command = sys.argv[1:]
    _kill_on_parent_exit(int(parent))
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
    """Set the resource limit `which` to `asked`, or to the present hard limit if that is lower.

    Only root may raise a hard limit.
    """
    _, own = resource.getrlimit(which)
    least = asked if own == resource.RLIM_INFINITY else min(asked, own)
    resource.setrlimit(which, (least, least))


def _kill_on_parent_exit(parent: int) -> None:
    """Arrange that the kernel kills this process when the parent process ends, on Linux."""
    if not sys.platform.startswith("linux"):
        return
    import ctypes

    ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # the parent ended before this setting took effect
        os._exit(1)


if __name__ == "__main__":
    main()

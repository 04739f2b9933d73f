"""Files that no one writes by hand, one by one through `dsl check` in a process of its own: a table of time and memory.

    python tests/fuzz/extremes.py [NAME...]      exit 1 if one is slow, large, or ends in a traceback

Needs 2 GB of space for what is temporary; nothing else than softmark.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

LIMIT_S, LIMIT_MB = 10.0, 2048.0
Make = Callable[[Path], "list[str] | None"]  # writes x.scene in a folder; what to run instead of `check x.scene`


def text(words: Callable[[], str | bytes]) -> Make:
    """A file of these words, made when they are wanted: a process starts out with the peak of the one it comes from."""

    def make(folder: Path) -> None:
        found = words()
        (folder / "x.scene").write_bytes(found if isinstance(found, bytes) else found.encode())

    return make


FULL = 990_000  # characters: as much as is read


def filled(line: Callable[[int], str], size: int = FULL) -> str:
    """Lines up to a size."""
    rows, length = [], 0
    while length < size:
        rows.append(line(len(rows)))
        length += len(rows[-1])
    return "".join(rows[:-1])


def files(**words: str) -> Make:
    """Several files; `x` is the scene."""

    def make(folder: Path) -> None:
        for name, content in words.items():
            (folder / f"{name}.scene").write_text(content, encoding="utf-8")

    return make


def holes(size: int) -> Make:
    """A file of NULs that takes no space."""

    def make(folder: Path) -> None:
        with (folder / "x.scene").open("wb") as file:
            file.truncate(size)

    return make


def large(folder: Path) -> None:
    """1 GB of declarations."""
    with (folder / "x.scene").open("w") as file:
        for _ in range(1000):
            file.write("param abcdefgh = 1 # 34567890123\n" * 31_250)


def ring(n: int) -> Make:
    """Scenes that use each other in a circle."""
    return files(
        **{("x" if i == 0 else f"x{i}"): f'use "{"x" if i == n - 1 else f"x{i + 1}"}.scene" as a\n' for i in range(n)}
    )


def diamonds(n: int) -> Make:
    """Each scene uses the next one twice: 2^n if every use is read."""
    names = ["x", *(f"x{i}" for i in range(1, n + 1))]
    texts = {a: f'use "{b}.scene" as p\nuse "{b}.scene" as q\nparam k = 1\n' for a, b in pairwise(names)}
    return files(**texts, **{names[-1]: "param k = 1\n"})


def link(target: str) -> Make:
    """A scene that uses a link."""

    def make(folder: Path) -> None:
        (folder / "x.scene").write_text('use "y.scene" as k\nparam a = 1\n', encoding="utf-8")
        (folder / "y.scene").symlink_to(target)

    return make


def pipe(folder: Path) -> None:
    """A scene that uses a pipe that nobody writes to."""
    (folder / "x.scene").write_text('use "y.scene" as k\n', encoding="utf-8")
    os.mkfifo(folder / "y.scene")


def named(name: str, make: Callable[[Path], Any]) -> Make:
    """Something else than a file, named on the command line."""

    def prepare(folder: Path) -> list[str]:
        make(folder / name)
        return ["check", name]

    return prepare


def endless(kind: str) -> Make:
    """Standard input without an end."""

    def prepare(folder: Path) -> list[str]:
        return ["<" + kind, "check", "-"]

    return prepare


def mesh(content: str, name: str) -> Make:
    """A beam whose shape is a file."""
    scene = f'material m = neo_hookean(60 kPa, 0.4, 1000 kg/m^3)\nbody b = solid(mesh("{name}", unit = 1 mm), m)\n'

    def make(folder: Path) -> None:
        (folder / "x.scene").write_text(scene, encoding="utf-8")
        (folder / name).symlink_to(content)

    return make


def chain(n: int, form: str = "param p{i} = p{j}\n", turned: bool = True) -> str:
    """Parameters each of which is made of the next."""
    lines = [form.format(i=i, j=i + 1) for i in range(n)]
    return "".join(lines if turned else lines[::-1]) + f"param p{n} = 1.0\n"


BEAM = """material m = neo_hookean(60 kPa, 0.4, 1000 kg/m^3)
body rod = solid(cylinder(length = 100 mm, radius = 10 mm), m)
support wall = fixed(rod, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2)
probe tip = point(rod, at = (100, 0, 0) mm)
model a = fem(tet4, strain = corotational, size = 5 mm)
reference e = elastica(rod)
metric eta = tip_error(tip, against = e)
"""

CASES: dict[str, Make] = {
    "1 GB of declarations": large,
    "1 TB of holes": holes(10**12),
    "1 MB of NULs": holes(FULL),
    "empty": text(lambda: ""),
    "binary": text(lambda: bytes(range(256)) * 4000),
    "UTF-16": text(lambda: "param a = 1\n".encode("utf-16")),
    "UTF-16 without a mark": text(lambda: "param a = 1\n".encode("utf-16-le")),
    "UTF-32": text(lambda: "param a = 1\n".encode("utf-32")),
    "byte-order mark": text(lambda: "\ufeffparam a = 1\n"),
    "two byte-order marks": text(lambda: "\ufeff\ufeffparam a = 1\n"),
    "1 MB of comments": text(lambda: filled(lambda i: "# nothing\n")),
    "1 MB of blank lines": text(lambda: "\n" * FULL),
    "1 MB of declarations": text(lambda: filled(lambda i: f"param p{i} = {i}\n")),
    "10^6 declarations of 20 MB": text(lambda: "".join(f"param p{i} = {i}\n" for i in range(1_000_000))),
    "1 MB of declarations of one name": text(lambda: filled(lambda i: "param a = 1\n")),
    "1 MB of wrong kinds": text(lambda: filled(lambda i: f"foo a{i} = bar()\n")),
    "1 MB of unknown names": text(lambda: filled(lambda i: f"param p{i} = q\n")),
    "1 MB of misspelt names": text(lambda: filled(lambda i: f"param parameter{i} = paramter{i}\n")),
    "1 MB of syntax errors": text(lambda: filled(lambda i: "param = 1\n")),
    "1 MB of uses of missing files": text(lambda: filled(lambda i: f'use "y{i}.scene" as y{i}\n')),
    "a line of 1 MB": text(lambda: "param a = [" + "1," * 490_000 + "1]\n"),
    "a sum of 240 000": text(lambda: "param a = 1" + " + 1" * 240_000 + "\n"),
    "a comment of 1 MB": text(lambda: "#" * FULL + "\nparam a = 1\n"),
    "a text of 1 MB": text(lambda: 'scene "' + "a" * FULL + '"\n'),
    "a name of 1 MB": text(lambda: "param " + "a" * FULL + " = 1\n"),
    "10^5 brackets": text(lambda: "param a = " + "(" * 100_000 + "1" + ")" * 100_000 + "\n"),
    "10^5 lists": text(lambda: "param a = " + "[" * 100_000 + "1" + "]" * 100_000 + "\n"),
    "150 000 calls": text(lambda: "param a = " + "sqrt(" * 150_000 + "1" + ")" * 150_000 + "\n"),
    "490 000 open brackets in lines": text(lambda: "(\n" * 490_000),
    "1e400": text(lambda: "param a = 1e400\n"),
    "1e-400": text(lambda: "param a = 1e-400\n"),
    "10^5 digits": text(lambda: "param a = " + "7" * 100_000 + "\n"),
    "10^5 digits of an exponent": text(lambda: "param a = 1e" + "7" * 100_000 + "\n"),
    "400 digits of an exponent": text(lambda: "param a = 1e" + "7" * 390 + "\n"),
    "a tower of powers": text(lambda: "param a = 9^9^9^9^9^9^9^9\n"),
    "a tower of 150 powers": text(lambda: "param a = " + "2^" * 149 + "2\n"),
    "powers of a unit": text(
        lambda: "param p0 = 1 m^12\n" + "".join(f"param p{i + 1} = p{i}^99\n" for i in range(3000))
    ),
    "squares of a unit": text(
        lambda: "param p0 = 1 m\n" + "".join(f"param p{i + 1} = p{i}*p{i}\n" for i in range(35_000))
    ),
    "a unit of size infinity": text(lambda: "param a = 0 Tm^12*Tm^12*Tm^12\nparam b = a\n"),
    "a unit of size zero": text(lambda: "param a = 1 m/(pm^12*pm^12*pm^12)\n"),
    "a unit to the 10^300": text(lambda: "param a = 1 m^" + "9" * 300 + "\n"),
    "a vector beyond numbers": text(lambda: "param a = (1e300, 0, 0) Tm^12\n"),
    "40 000 parameters in a row": text(lambda: chain(40_000)),
    "40 000 parameters in a row, forwards": text(lambda: chain(40_000, turned=False)),
    "10^4 parameters of sums": text(lambda: chain(10_000, "param p{i} = p{j} + p{j} - p{j}\n")),
    "10^4 materials in a row": text(
        lambda: (
            "".join(f"material m{i} = m{i + 1}\n" for i in range(10_000))
            + "material m10000 = neo_hookean(1 kPa, 0.4)\n"
        )
    ),
    "a circle of 10^4": text(lambda: "".join(f"param p{i} = p{(i + 1) % 10_000}\n" for i in range(10_000))),
    "10^5 mentions": text(lambda: chain(750, "param p{i} = p{j}" + " + 0*p{j}" * 140 + "\n")),
    "expect: 20 000": text(lambda: BEAM + "".join(f"expect a.eta < {i + 1} mm\n" for i in range(20_000))),
    "a chain of 10^5 comparisons": text(lambda: BEAM + "expect a.eta" + " < 1 mm" * 100_000 + "\n"),
    "2000 models": text(
        lambda: BEAM + "".join(f"model m{i} = fem(tet4, strain = corotational, size = 5 mm)\n" for i in range(2_000))
    ),
    "2000 probes": text(lambda: BEAM + "".join(f"probe t{i} = point(rod, at = (100, 0, 0) mm)\n" for i in range(2000))),
    "100 lines of 10^5 points": text(
        lambda: (
            BEAM
            + "".join(
                f"probe t{i} = line(rod, from = (0, 0, 0) mm, to = (100, 0, 0) mm, points = 100000)\n"
                for i in range(100)
            )
        )
    ),
    "a condition of 60 000 parts": text(
        lambda: BEAM + "load p = pressure(rod, magnitude = 1 Pa, where = x > 0 mm" + " and x > 0 mm" * 60_000 + ")\n"
    ),
    "a comparison of 10^4": text(
        lambda: BEAM + "load p = pressure(rod, magnitude = 1 Pa, where = 0 mm" + " < x" * 10_000 + ")\n"
    ),
    "a sweep of 10^4": text(
        lambda: (
            BEAM
            + "param k = 1\nstudy s = sweep(a.size, over = ["
            + "".join(f"{i + 1}, " for i in range(10_000))
            + "] mm)\n"
        )
    ),
    "a product of sweeps": text(
        lambda: (
            BEAM
            + "study s = sweep(a.size, over = ["
            + "5.0, " * 100
            + "] mm)\nstudy t = sweep(m.young, over = ["
            + "5.0, " * 100
            + "] kPa, with = s)\n"
        )
    ),
    "a circle of 2": ring(2),
    "a circle of 10": ring(10),
    "a diamond of 30": diamonds(30),
    "a chain of 200 uses": files(
        **{("x" if i == 0 else f"x{i}"): f'use "x{i + 1}.scene" as a\n' for i in range(200)},
        x200="param a = 1\n",
    ),
    "500 uses of 40 kB": files(
        x="".join(f'use "y.scene" as y{i}\n' for i in range(499)),
        y="".join(f"param p{i} = {i}\n" for i in range(4_000)),
    ),
    "itself through a link": link("x.scene"),
    "a link to itself": link("y.scene"),
    "a link to /dev/zero": link("/dev/zero"),
    "a link to a terminal": link("/dev/tty"),
    "a link to a folder": link("."),
    "a pipe": pipe,
    "/dev/zero by name": text(lambda: 'use "/dev/zero" as k\n'),
    "/proc/self/mem by link": link("/proc/self/mem"),
    "a folder as the scene": named("y.scene", lambda p: p.mkdir()),
    "a pipe as the scene": named("y.scene", lambda p: os.mkfifo(p)),
    "/dev/zero as the scene": named("y.scene", lambda p: p.symlink_to("/dev/zero")),
    "standard input: /dev/zero": endless("/dev/zero"),
    "standard input: endless lines": endless("yes"),
    "a mesh in a pipe": lambda folder: (mesh("z", "y.msh")(folder), os.mkfifo(folder / "z"))[0],
    "a mesh in /dev/zero": mesh("/dev/zero", "y.msh"),
    "bidirectional names": text(
        lambda: 'param \u202ea = 1\nparam a\u200bb = 2\n# \u202e hidden\nscene "\u2066x\u2069"\n'
    ),
    "NUL inside": text(lambda: "param a = 1\nparam b\0 = 2\n"),
    "CR": text(lambda: BEAM.replace("\n", "\r")),
    "CRLF": text(lambda: BEAM.replace("\n", "\r\n")),
    "mixed ends": text(lambda: BEAM.replace("\n", "\r\n", 3).replace("\n", "\r", 1)),
    "ends of other kinds": text(lambda: BEAM.replace("\n", "\u2028", 2) + "\x0b\x0c\x85"),
}


def measured(make: Make) -> tuple[float, float, float, int, str]:
    """Wall and CPU seconds, MB, exit status and what was said."""
    with tempfile.TemporaryDirectory(prefix="softmark-extreme-") as name:
        folder = Path(name)
        arguments = make(folder) or ["check", "x.scene"]
        feeder = None
        source: Any = subprocess.DEVNULL
        if arguments[0].startswith("<"):
            feed = arguments.pop(0)[1:]
            command = ["yes", "param a = 1"] if feed == "yes" else ["cat", feed]
            feeder = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
            source = feeder.stdout
        start = time.monotonic()
        with (folder / "said").open("wb") as said:
            child = subprocess.Popen(
                [sys.executable, "-m", "softmark.interpreter", *arguments],
                cwd=folder,
                stdin=source,
                stdout=said,
                stderr=said,
                preexec_fn=_bounded,
            )
            killer = time.monotonic() + 300
            while (done := os.wait4(child.pid, os.WNOHANG))[0] == 0:
                if time.monotonic() > killer:
                    child.kill()
                time.sleep(0.02)
        if feeder:
            feeder.kill()
            feeder.wait()
        _, status, used = done
        child.returncode = os.waitstatus_to_exitcode(status)
        with (folder / "said").open("rb") as said:
            words = said.read(4000).decode("utf-8", errors="replace")
            size = os.path.getsize(folder / "said")
        return (
            time.monotonic() - start,
            used.ru_utime + used.ru_stime,
            used.ru_maxrss / 1024,
            child.returncode,
            f"{words}\0{size}",
        )


def _bounded() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))


def main() -> int:
    """A row for every case."""
    chosen = [n for n in CASES if not sys.argv[1:] or any(a in n for a in sys.argv[1:])]
    wrong = 0
    for name in chosen:
        wall, cpu, megabytes, status, words = measured(CASES[name])
        said, _, size = words.rpartition("\0")
        bad = (
            cpu > LIMIT_S
            or megabytes > LIMIT_MB
            or status not in (0, 2)
            or "Traceback" in said
            or int(size) > 1_000_000
        )
        wrong += bad
        first = next((line for line in said.splitlines() if line.strip()), "")[:70]
        print(
            f"{'BAD' if bad else 'ok':<4}{name:<38}{wall:7.2f} s {cpu:6.2f} CPU s {megabytes:6.0f} MB {status:>4}"
            f" {int(size):>9} B  {first}",
            flush=True,
        )
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())

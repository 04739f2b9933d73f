"""What shells complete: scenes, models, parameters, fields, templates, words and files; in the shells themselves."""

from __future__ import annotations

import os
import pty
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from softmark.interpreter.cli.commands.completion import SHELLS
from softmark.interpreter.cli.completion.candidates import find_candidates
from softmark.interpreter.cli.main import COMMANDS

MINE = "param L = 2 mm\nmodel fine = fem(tet4, size = L)\nmodel rod = beam6dof()\nstudy s = sweep(L, over = [1] mm)\n"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with scenes and other files, to work in; `dsl` is this one."""
    (tmp_path / "mine.scene").write_text(MINE)
    (tmp_path / "broken.scene").write_text("model a = fem(tet4)\nmodel b = = 3\nparam k = 1\n")
    (tmp_path / "my parts").mkdir()
    (tmp_path / "my parts" / "a b.scene").write_text(MINE)
    for name in ("deck.inp", "mesh.msh", "others.py", "old.json", "notes.txt"):
        (tmp_path / name).touch()
    program = tmp_path / ".bin" / "dsl"
    program.parent.mkdir()
    begin = "import sys; from softmark.interpreter.cli.main import main; sys.exit(main(sys.argv[1:]))"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -c "{begin}" "$@"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}:{os.environ['PATH']}")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(("line", "found"), [
    ("run mine.scene --model |", "fine rod"),
    ("run mine.scene --model fine --model |", "rod"),
    ("run mine.scene --model=r|", "--model=rod"),
    ("run mine.scene --model = r|", "rod"),  # as bash splits it
    ("run mine.scene -p |", "L="),
    ("run mine.scene -p fine.si|", "fine.size="),
    ("compare mine.scene --vary |", "L= model="),
    ("compare mine.scene --study |", "s"),
    ("compare old|", "old.json"),
    ("run -p L=3mm mine.scene --model r|", "rod"),
    ("run nothing.scene --model |", ""),
    ("run broken.scene --model |", "a"),
    ("run ./m|", "./mine.scene ./my parts/"),
    ("run my parts/|", ""),  # two words, for the shell takes a blank for what parts them
    ("check mine.scene br|", "broken.scene"),
    ("import |", "deck.inp mesh.msh my parts/"),
    ("conformance o|", "others.py"),
    ("check mine.scene --plugin o|", "others.py"),
    ("new pu|", "pull"),
    ("explain cyl|", "cylinder"),
    ("explain E10|", "E101 E102 E103 E104 E105 E106 E107 E108 E109"),
    ("list mod|", "models"),
    ("export mine.scene --to |", "calculix febio gmsh mujoco polyfem sofa vtu"),
    ("run mine.scene --st|", "--stated"),
    ("run mine.scene --out |", "my parts/"),
    ("run mine.scene --repeat |", ""),
    ("completion b|", "bash"),
    ("comp|", "compare completion"),
    ("nothing |", ""),
])  # fmt: skip
def test_what_could_stand_next(line: str, found: str) -> None:
    *words, last = line.removesuffix("|").split(" ")
    assert " ".join(find_candidates([*words, last])) == found


@pytest.mark.usefixtures("here")
def test_scenes_are_those_of_the_library_and_of_the_folder() -> None:
    assert {"mine.scene", "my parts/", "mandels-slab"} <= set(find_candidates(["run", "m"]))
    assert list(find_candidates(["run", "mine.scene", "--model", "="])) == ["fine", "rod"]  # as bash splits it


def test_every_command_is_completed() -> None:
    assert set(COMMANDS) < set(find_candidates([""]))
    for command in COMMANDS:
        assert "--help" not in find_candidates([command, ""])
        find_candidates([command, ""])
        find_candidates([command, "-"])


def test_a_template_and_a_word_say_what_they_are() -> None:
    assert find_candidates(["new", "pull"])["pull"].startswith("My tensile test")
    assert find_candidates(["explain", "cylinder"]) == {"cylinder": "shape"}
    assert find_candidates(["run", "silicone-beam", "-p", "L"]) == {"L=": "178 mm"}


def test_bash_completes_by_asking(here: Path) -> None:
    """The function itself, without a terminal; the script comes from the command."""
    probe = 'eval "$(dsl completion bash)"; COMP_WORDS=(dsl run mine.scene --model f); COMP_CWORD=4; _dsl'
    done = subprocess.run(["bash", "-c", f'{probe}; printf "%s|" "${{COMPREPLY[@]}}"'], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("fine|", "")


def test_bash_runs_nothing_that_a_file_is_named_by(here: Path) -> None:
    """What it offers is taken as it stands: it means the file, however that is named, and nothing else."""
    names = ("$(touch${IFS}ran).scene", "x;touch`x`.scene")
    for name in (*names, "two\nlines.scene"):
        (here / name).touch()
    probe = 'eval "$(dsl completion bash)"; COMP_WORDS=(dsl fmt ""); COMP_CWORD=2; _dsl; IFS=" "'
    probe += """; eval "printf '%s|' ${COMPREPLY[*]}" """
    done = subprocess.run(["bash", "-c", probe], capture_output=True, text=True)
    offered = set(done.stdout.split("|"))
    assert offered >= {*names, "my parts/", "mine.scene"}
    assert not offered & {"two", "lines.scene"}
    assert not (here / "ran").exists()


@pytest.mark.slow
@pytest.mark.parametrize("line", ["run silicone-beam --model c", "run silicone-beam -p rod.s", "explain c", "import d"])
@pytest.mark.usefixtures("here")
def test_an_answer_imports_no_solver(line: str) -> None:
    """An answer comes at once if nothing heavy is imported: a third of a second of CPU on a quiet machine."""
    program = (
        "import sys; from softmark.interpreter.cli.main import main; main(['completion', 'answers']);"
        "print([m for m in ('numpy', 'scipy', 'numba', 'meshio', 'softmark.solvers.statics') if m in sys.modules],"
        " file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        input="\0".join([*line.split(), ""]),
        text=True,
        check=True,
        capture_output=True,
    )
    assert done.stderr.splitlines()[-1] == "[]"


READY = "ready> "
BEGIN = {  # how each is started, and what a user puts into its file
    "bash": (["bash", "--norc", "-i"], f'bind "set bell-style none"; PS1="{READY}"; eval "$(dsl completion bash)"'),
    "zsh": (["zsh", "-f", "-i"], f'setopt nobeep; PS1="{READY}"; autoload -U compinit && compinit -u -D; '
            'eval "$(dsl completion zsh)"'),
}  # fmt: skip
TYPED = {
    "dsl run mine.scene --model f": "dsl run mine.scene --model fine ",
    "dsl run mine.scene --model=f": "dsl run mine.scene --model=fine ",
    "dsl run mine.scene -p ": "dsl run mine.scene -p L=",
    "dsl new pu": "dsl new pull ",
    "dsl run my\\ p": "dsl run my\\ parts/",
    "dsl run my\\ parts/": "dsl run my\\ parts/a\\ b.scene ",
    "dsl explain cyl": "dsl explain cylinder ",
    "dsl import d": "dsl import deck.inp ",
}


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("shell", BEGIN)
@pytest.mark.usefixtures("here")
def test_a_shell_completes_what_is_typed(shell: str) -> None:
    """In a terminal of its own, as a person types."""
    if not shutil.which(shell):
        pytest.skip(f"no {shell} here")
    command, setup = BEGIN[shell]
    with Terminal(command) as terminal:
        terminal.type(f"{setup}\n")
        terminal.until(READY, times=2)  # what is typed, and the prompt
        for typed, completed in TYPED.items():
            terminal.type(f"{typed}\t")
            terminal.until(completed)
            terminal.type("\x15\n")  # the line is taken back
            terminal.until(READY)


@pytest.mark.slow
@pytest.mark.usefixtures("here")
def test_fish_completes_what_is_typed() -> None:
    if not shutil.which("fish"):
        pytest.skip("no fish here")
    for typed, completed in TYPED.items():
        ask = f"dsl completion fish | source; complete -C '{typed}'"
        done = subprocess.run(["fish", "-c", ask], capture_output=True, text=True, check=True)
        plain = completed.replace("\\ ", " ").removeprefix("dsl ").rstrip()
        assert [plain.endswith(line.partition("\t")[0]) for line in done.stdout.splitlines()] == [True], done.stdout


@pytest.mark.parametrize("shell", SHELLS)
def test_each_shell_has_a_script_that_asks(shell: str) -> None:
    from softmark.interpreter.cli import completion

    assert "dsl completion answers" in (Path(completion.__file__).parent / f"dsl.{shell}").read_text(encoding="utf-8")


class Terminal:
    """A program in a terminal of its own."""

    def __init__(self, command: list[str]) -> None:
        self.child, self.end = pty.fork()
        if self.child == 0:
            os.environ.update(TERM="dumb", COLUMNS="200")
            os.execvp(command[0], command)
        self.seen = ""

    def __enter__(self) -> Terminal:
        return self

    def __exit__(self, *raised: object) -> None:
        os.close(self.end)
        os.waitpid(self.child, 0)

    def type(self, text: str) -> None:
        """Send keys; what was seen before is forgotten."""
        self.seen = ""
        os.write(self.end, text.encode())

    def until(self, text: str, times: int = 1, within: float = 20.0) -> None:
        """Read until a text was seen some times; it fails after as many seconds."""
        last = time.monotonic() + within
        while self.seen.count(text) < times:
            assert time.monotonic() < last, f"{text!r} is not in {self.seen!r}"
            if select.select([self.end], [], [], 0.1)[0]:
                self.seen += os.read(self.end, 65536).decode(errors="replace")

"""What editors are given: the words of the classes, and files that the editors themselves take."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import pytest

from softmark.grammar.parse_table import reserved_words
from softmark.interpreter.cli.main import main
from softmark.interpreter.help.word_pages import constructors
from softmark.interpreter.language_server.syntax_highlighting import (
    EDITORS,
    emacs_mode,
    kate_syntax,
    neovim_files,
    textmate_grammar,
    tree_sitter_grammar,
    vim_syntax,
    vscode_extension,
)
from softmark.interpreter.language_server.syntax_highlighting.highlighted_words import Words, words
from softmark.interpreter.language_server.syntax_highlighting.token_roles import parts
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.scenes import ROOT

HOUSE = Path(__file__).parents[2]
SCENES = sorted(ROOT.rglob("*.scene"))


def test_the_words_are_those_of_the_classes() -> None:
    own = words()
    assert set(own.reserved) == set(reserved_words())
    assert set(own.kinds) == set(CATALOGUE)
    assert set(own.constructors) == {name for table in CATALOGUE.values() for name in table}
    assert set(CATALOGUE.words()) < set(own.constants)
    assert {option for c in constructors() for f in c.fields for option in f.options} <= set(own.constants)


def _of_textmate() -> Words:
    found = textmate_grammar.grammar()["repository"]

    def alternatives(name: str) -> list[str]:
        inside = re.search(r"\(?(?:\?:)?((?:\w+\|)+\w+)\)", found[name]["match"])
        return sorted(inside[1].split("|")) if inside else []

    names = ("reserved", "declaration", "constructor", "function", "constant")
    return Words(*(alternatives(name) for name in names))


def _of_vim() -> Words:
    text = vim_syntax.syntax()
    lists = [re.search(rf"scene{name} '[^(]*\(([\w|]+)\)", text) for name in ("Kind", "Constructor", "Function")]
    constant = re.search(r"sceneConstant '[^(]*<\(([\w|]+)\)", text)
    found = [sorted(one[1].split("|")) for one in (*lists, constant) if one]
    return Words(re.findall(r"sceneReserved (.*)", text)[0].split(), *found)


def _of_emacs() -> Words:
    text = emacs_mode.files()[emacs_mode.FILE].decode()
    assert "@" not in text
    found = {name: re.findall(r'"(\w+)"', inside) for name, inside in re.findall(r"softmark-(\w+) '\(([^)]*)\)", text)}
    return Words(**found)


def _of_kate() -> Words:
    root = Xml.fromstring(kate_syntax.syntax())
    return Words(**{str(one.get("name")): [str(item.text) for item in one] for one in root.iter("list")})


def _of_tree_sitter() -> Words:
    text = tree_sitter_grammar.queries()
    quoted = r'((?:"\w+" ?)+)'
    patterns = {
        "reserved": rf"\[{quoted}\] @keyword",
        "kinds": rf"@keyword {quoted}\)", "constructors": rf"@constructor {quoted}\)",
        "functions": rf"@function.builtin {quoted}\)", "constants": rf"@constant {quoted}\)",
    }  # fmt: skip
    found = {name: re.search(pattern, text) for name, pattern in patterns.items()}
    return Words(**{name: re.findall(r"\w+", one[1]) for name, one in found.items() if one})


@pytest.mark.parametrize("read", [_of_textmate, _of_vim, _of_emacs, _of_kate, _of_tree_sitter])
def test_every_editor_knows_these_words_and_no_others(read: Any) -> None:
    assert read() == words()


# ---------------------------------------------------------------- the TextMate grammar


def _patterns() -> dict[str, str]:
    """Its regular expressions; Python writes the letters of Oniguruma otherwise."""
    found = {name: part["match"] for name, part in textmate_grammar.grammar()["repository"].items() if "match" in part}
    return {name: pattern.replace("[[:alpha:]µμ]", r"[^\W\d_]") for name, pattern in found.items()}


@pytest.mark.parametrize(
    ("text", "number", "unit"),
    [
        ("60 kPa", "60", "kPa"),
        ("1070 kg/m^3)", "1070", "kg/m^3"),
        ("5 %", "5", "%"),
        ("3µm", "3", "µm"),
        ("4 J/(kg*K),", "4", "J/(kg*K)"),
        ("0.49 in 0", "0.49", None),
        ("3 mm and y", "3", "mm"),
        ("0..5", "0", None),
        ("1e-3", "1e-3", None),
    ],
)
def test_quantities_are_what_the_parser_takes_for_them(text: str, number: str, unit: str | None) -> None:
    found = re.match(_patterns()["quantity"], text)
    assert found is not None
    assert (found[1], found[2]) == (number, unit)
    assert [part.text for part in parts(text)[:2]][: 2 if unit else 1] == ([number, unit] if unit else [number])


def test_declarations_are_of_kinds_that_there_are() -> None:
    pattern = re.compile(_patterns()["declaration"], re.M)
    text = "body  b = f(\n  c = 1)\nparam h = 1\nbodies c = 3\n"
    assert [match.groups() for match in pattern.finditer(text)] == [("body", "b")]


ROLES = {  # what a scope of the TextMate grammar stands for
    "comment.line.number-sign": "comment", "keyword.control": "reserved", "storage.type": "kind",
    "entity.name.type": "declared", "support.class": "constructor", "support.function": "function",
    "entity.name.function": "function", "variable.parameter": "field", "support.constant": "constant",
    "variable.other": "name", "constant.numeric": "number", "keyword.other.unit": "unit",
    "string.quoted.double": "string", "keyword.operator": "operator",
}  # fmt: skip


@pytest.mark.slow
def test_the_engine_of_vs_code_gives_every_word_of_the_scenes_its_role(tmp_path: Path) -> None:
    """With `vscode-textmate` and `vscode-oniguruma` of npm, where NODE_PATH leads to them."""
    found = subprocess.run(
        [_needs("node"), "-e", "require('vscode-textmate'); require('vscode-oniguruma')"], capture_output=True
    )
    if found.returncode:
        pytest.skip("vscode-textmate is not installed here")
    grammar = _written(textmate_grammar.files(), tmp_path) / textmate_grammar.FILE
    ask = ["node", str(Path(__file__).parents[1] / "shared" / "textmate_tokens.js"), str(grammar), *map(str, SCENES)]
    seen = json.loads(subprocess.run(ask, capture_output=True, text=True, check=True, timeout=60).stdout)
    for scene in SCENES:
        text = scene.read_text(encoding="utf-8")
        scopes = {(line, column): scope for line, row in enumerate(seen[str(scene)]) for column, _, scope in row}
        for part in parts(text):
            before = text[: part.start]
            at = (before.count("\n"), part.start - before.rfind("\n") - 1)
            if part.role != "bracket":
                assert ROLES[scopes[at].removesuffix(".softmark")] == part.role, (scene, at, part)


# ---------------------------------------------------------------- roles, and Pygments


@pytest.mark.slow
def test_every_shipped_scene_is_cut_into_words_without_an_error() -> None:
    for scene in SCENES:
        text = scene.read_text(encoding="utf-8")
        found = parts(text)
        assert [part for part in found if part.role == "error"] == [], scene
        assert re.sub(r"\s", "", "".join(part.text for part in found)) == re.sub(r"\s", "", text), scene


def test_words_have_their_roles() -> None:
    text = 'param L = 2 mm  # long\nmodel m = fem(tet4, size = abs(L))\nuse "a.scene" as a\nexpect m.eta < 5 % ; x\n'
    roles = {part.text: part.role for part in parts(text)}
    assert roles == {
        "param": "reserved", "L": "name", "=": "operator", "2": "number", "mm": "unit", "# long": "comment",
        "model": "kind", "m": "declared", "fem": "constructor", "(": "bracket", "tet4": "constant", ",": "bracket",
        "size": "field", "abs": "function", ")": "bracket", "use": "reserved", '"a.scene"': "string", "as": "reserved",
        "a": "declared", "expect": "reserved", "m.eta": "name", "<": "operator", "5": "number", "%": "unit",
        ";": "error", "x": "constant",
    }  # fmt: skip


def test_pygments_finds_the_lexers_by_the_project_file() -> None:
    pygments = pytest.importorskip("pygments")
    points = tomllib.loads((HOUSE / "pyproject.toml").read_text())["project"]["entry-points"]["pygments.lexers"]
    from importlib import import_module

    from pygments.token import Error, Generic

    for point in points.values():
        module, _, name = point.partition(":")
        assert name in vars(import_module(module))
    from softmark.interpreter.language_server.syntax_highlighting.pygments_lexer import MessageLexer, SceneLexer

    for scene in SCENES[:10]:
        text = scene.read_text(encoding="utf-8")
        found = list(pygments.lex(text, SceneLexer(stripnl=False)))
        assert Generic.Error not in {kind for kind, _ in found}
        assert "".join(value for _, value in found) == text
    message = "error[E204]: expected a pressure\n  --> a.scene:5:41\n   |\n 5 | x\n   | ^ a length\n   = help: Pa\n"
    found = list(pygments.lex(message, MessageLexer()))
    assert Error not in {kind for kind, _ in found}
    assert ("Token.Name.Label", "[E204]") in [(str(kind), value) for kind, value in found]


# ---------------------------------------------------------------- files and editors


@pytest.mark.parametrize("editor", EDITORS)
def test_the_command_writes_what_an_editor_takes(
    editor: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["editor", editor, "--out", str(tmp_path / "it")]) == 0
    said = capsys.readouterr().out
    files = [Path(line) for line in said.split("\n\n")[0].splitlines()]
    assert files
    assert all(file.is_file() for file in files)
    assert "\n\n" in said  # how it is installed


def test_the_command_says_what_there_is(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["editor"]) == 0
    assert [line.split()[2] for line in capsys.readouterr().out.splitlines()] == list(EDITORS)
    (tmp_path / "taken").touch()
    assert main(["editor", "vim", "--out", str(tmp_path / "taken")]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_the_extension_of_vs_code_is_whole() -> None:
    made = vscode_extension.files()[vscode_extension.FILE]
    assert made == vscode_extension.files()[vscode_extension.FILE]  # the same sources, the same file
    with zipfile.ZipFile(io.BytesIO(made)) as archive:
        assert archive.testzip() is None
        names = set(archive.namelist())
        package = json.loads(archive.read("extension/package.json"))
        manifest = Xml.fromstring(archive.read("extension.vsixmanifest"))
        types = Xml.fromstring(archive.read("[Content_Types].xml"))
        grammar = json.loads(archive.read("extension/scene.tmLanguage.json"))
    space = {"v": "http://schemas.microsoft.com/developer/vsx-schema/2011"}
    identity = manifest.find("v:Metadata/v:Identity", space)
    assert identity is not None
    assert (identity.get("Id"), identity.get("Version"), identity.get("Publisher")) == (
        package["name"], package["version"], package["publisher"])  # fmt: skip
    assert {str(a.get("Path")) for a in manifest.iterfind("v:Assets/v:Asset", space)} <= names
    assert {f".{name.rpartition('.')[2]}" for name in names} - {".xml"} <= {str(one.get("Extension")) for one in types}
    given = package["contributes"]
    named = [
        package["main"],
        *(one["configuration"] for one in given["languages"]),
        *(g["path"] for g in given["grammars"]),
    ]
    assert {f"extension/{name.removeprefix('./')}" for name in named} <= names
    assert given["grammars"][0]["scopeName"] == grammar["scopeName"]
    assert f'"{given["languages"][0]["id"]}"' in vscode_extension.CLIENT.read_text()


def _needs(program: str) -> str:
    if not shutil.which(program):
        pytest.skip(f"no {program} here")
    return program


def _written(files: dict[str, bytes], folder: Path) -> Path:
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


SMALL = "param L = 60 kPa\nmodel m = fem(tet4, size = L)  # so\nload w = f((1, 2) mm, [3] s) and 2 and 3\n"
SHOWN = """\
set runtimepath^={folder}
filetype plugin on
syntax on
edit {scene}
redir! > {out}
let places = [[1, 1], [1, 11], [1, 14], [2, 1], [2, 7], [2, 11], [2, 15], [2, 21], [2, 33]]
for place in places + [[3, 19], [3, 27], [3, 30], [3, 36]]
  echo synIDattr(synID(place[0], place[1], 1), 'name')
endfor
echo &filetype &commentstring
redir END
qall!
"""


@pytest.mark.slow
@pytest.mark.parametrize("program", ["vim", "nvim"])
def test_vim_and_neovim_colour_a_scene(program: str, tmp_path: Path) -> None:
    files = vim_syntax.files() if program == "vim" else neovim_files.files()
    folder = _written(files, tmp_path / "runtime")
    (tmp_path / "a.scene").write_text(SMALL)
    script = tmp_path / "script.vim"
    script.write_text(SHOWN.format(folder=folder, scene=tmp_path / "a.scene", out=tmp_path / "out"))
    subprocess.run([_needs(program), "-u", "NONE", "-es", "-S", str(script)], stdin=subprocess.DEVNULL, timeout=60)
    found = (tmp_path / "out").read_text().split()
    roles = "Reserved Number Unit Kind Name Constructor Constant Field Comment Unit Unit Reserved Reserved"
    assert found == [*(f"scene{role}" for role in roles.split()), "scene", "#", "%s"]


@pytest.mark.slow
def test_emacs_compiles_the_mode_and_colours_a_scene(tmp_path: Path) -> None:
    library = _written(emacs_mode.files(), tmp_path) / emacs_mode.FILE
    (tmp_path / "a.scene").write_text(SMALL)
    ask = (
        "(progn (setq byte-compile-error-on-warn t) "
        f'(unless (byte-compile-file "{library}") (kill-emacs 1)) (load "{library}c") (find-file "{tmp_path}/a.scene") '
        '(font-lock-ensure) (princ (format "%S " major-mode)) (dolist (at \'(1 11 14 18 24 28 32 38 50 72 80 83 89)) '
        '(princ (format "%S " (get-text-property at \'face)))))'
    )
    done = subprocess.run([_needs("emacs"), "--batch", "-Q", "--eval", ask], capture_output=True, text=True, timeout=60)
    faces = "keyword constant type type variable-name function-name constant variable-name comment-delimiter "
    faces += "type type keyword keyword"
    assert done.stdout.split() == ["softmark-mode", *(f"font-lock-{face}-face" for face in faces.split())], done.stderr


@pytest.mark.slow
def test_kate_colours_a_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the program of KSyntaxHighlighting, which Kate uses."""
    _written({f"org.kde.syntax-highlighting/syntax/{kate_syntax.SYNTAX}": kate_syntax.syntax()}, tmp_path)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")
    (tmp_path / "a.scene").write_text(SMALL)
    ask = [_needs("kate-syntax-highlighter"), "-s", "softmark scene", "-f", "ansi", "--syntax-trace", "format"]
    done = subprocess.run([*ask, str(tmp_path / "a.scene")], capture_output=True, text=True, timeout=60)
    shown = re.sub(r"\x1b\[[0-9;]*[mK]", "", done.stdout)
    wanted = ("Reserved", "Name", "Number", "Unit", "Kind", "Constructor", "Constant", "Field", "Comment")
    assert [style for style in wanted if style not in shown] == []


@pytest.fixture
def our_dsl(tmp_path: Path) -> str:
    """A command that is this softmark."""
    program = tmp_path / "dsl"
    begin = "import sys; from softmark.interpreter.cli.main import main; sys.exit(main(sys.argv[1:]))"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -c "{begin}" "$@"\n')
    program.chmod(0o755)
    return str(program)


@pytest.mark.slow
def test_the_client_of_vs_code_talks_with_the_server(our_dsl: str, tmp_path: Path) -> None:
    """Under Node, with a stand-in for VS Code: a message comes, the text is mended, and it goes."""
    pytest.importorskip("pygls")
    scene = tmp_path / "a.scene"
    scene.write_text((ROOT / "templates" / "beam.scene").read_text().replace("length = L", "lenth = L"))
    stub = Path(__file__).parents[1] / "shared" / "vscode_stub.js"
    ask = [_needs("node"), str(stub), str(vscode_extension.CLIENT), our_dsl, str(scene)]
    done = subprocess.run(ask, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert ["E205" in str(one["code"]) for one in said["broken"] if one["severity"] == 0] == [True]
    assert said["left"] == []
    for method, answer in said["answers"].items():
        assert answer is not None, method
    assert said["answers"]["run"]["execution"]["words"] == ["run", str(scene), "--model", "rod"]
    assert not said.get("shown"), said["shown"]  # messages that the server shows: it could read all that it was told


@pytest.mark.slow
@pytest.mark.parametrize(
    ("trusted", "named", "heard"), [("yes", "bad.py", True), ("no", "bad.py", False), ("no", "{folder}/bad.py", False)]
)
def test_the_client_names_plugins_of_its_settings_but_none_beside_a_scene_that_is_not_trusted(
    our_dsl: str, tmp_path: Path, trusted: str, named: str, heard: bool
) -> None:
    """A plugin that is no Python is told by the server, which was told to load it."""
    pytest.importorskip("pygls")
    scene = tmp_path / "a.scene"
    scene.write_text((ROOT / "templates" / "beam.scene").read_text().replace("length = L", "lenth = L"))
    (tmp_path / "bad.py").write_text("SOFTMARK = {")
    stub = Path(__file__).parents[1] / "shared" / "vscode_stub.js"
    ask = [_needs("node"), str(stub), str(vscode_extension.CLIENT), our_dsl, str(scene), named.format(folder=tmp_path)]
    done = subprocess.run(ask, capture_output=True, text=True, timeout=60, env={**os.environ, "STUB_TRUSTED": trusted})
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert ["W730" in one for one in said["shown"]] == [True] * heard
    asked = ["--plugin", str(tmp_path / "bad.py")] if heard else []
    assert said["answers"]["own"]["execution"]["words"] == ["run", str(scene), *asked]


def test_a_folder_that_is_not_trusted_chooses_nothing_that_is_run() -> None:
    """VS Code leaves out what such a folder says of restricted settings: all that we have, each names what is run."""
    package = vscode_extension.package()
    own = set(package["contributes"]["configuration"]["properties"])
    assert own == {"softmark.command", "softmark.plugins"}
    trust = package["capabilities"]["untrustedWorkspaces"]
    assert trust["supported"] == "limited"
    assert set(trust["restrictedConfigurations"]) == own


@pytest.mark.slow
def test_the_client_says_how_to_install_a_server_that_is_not_there(tmp_path: Path) -> None:
    stub = Path(__file__).parents[1] / "shared" / "vscode_stub.js"
    (tmp_path / "a.scene").touch()
    ask = [
        _needs("node"),
        str(stub),
        str(vscode_extension.CLIENT),
        str(tmp_path / "nothing"),
        str(tmp_path / "a.scene"),
    ]
    done = subprocess.run(ask, capture_output=True, text=True, timeout=60)
    assert done.returncode == 3
    assert 'pip install "softmark[lsp]"' in done.stderr


@pytest.mark.slow
def test_a_host_of_extensions_installs_ours(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Any that is there: `code-server`, `codium`, ..., or what SOFTMARK_VSCODE says, such as `node server-main.js`."""
    hosts = ("code-server", "openvscode-server", "codium", "code")
    host = os.environ.get("SOFTMARK_VSCODE") or next((name for name in hosts if shutil.which(name)), None)
    if host is None:
        pytest.skip("no VS Code, nor anything like it, is here")
    monkeypatch.setenv("HOME", str(tmp_path))
    extension = _written(vscode_extension.files(), tmp_path) / vscode_extension.FILE
    ask = [*host.split(), "--install-extension", str(extension), "--extensions-dir", str(tmp_path / "theirs")]
    done = subprocess.run(ask, capture_output=True, text=True, timeout=120)
    assert "successfully installed" in done.stdout, done.stdout + done.stderr
    (package,) = (tmp_path / "theirs").glob("softmark.softmark-*/package.json")
    assert json.loads(package.read_text())["contributes"] == vscode_extension.package()["contributes"]

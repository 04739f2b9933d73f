"""Extension for VS Code and compatible editors (VSCodium, Cursor, code-server, Theia), as a `.vsix` file.

It is written without Node.
"""

from __future__ import annotations

import json
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from softmark import __version__
from softmark.interpreter.language_server.syntax_highlighting import textmate_grammar

TITLE = "an extension for VS Code and compatible editors: syntax highlighting and the language server"
FILE = f"softmark-{__version__}.vsix"
LANGUAGE = "softmark-scene"  # as in client.js
COMMANDS = ("run", "compare", "stress")  # as in client.js
CLIENT = Path(__file__).with_name("client.js")
EPOCH = (1980, 1, 1, 0, 0, 0)  # fixed date, for reproducible files


def files() -> dict[str, bytes]:
    """Return the extension as one file."""
    into = BytesIO()
    with ZipFile(into, "w", ZIP_DEFLATED) as archive:
        for name, content in contents().items():
            archive.writestr(ZipInfo(name, EPOCH), content, ZIP_DEFLATED)
    return {FILE: into.getvalue()}


def install(folder: Path) -> str:
    """Return instructions on how to install the extension from `folder` in VS Code."""
    return (
        f"code --install-extension {folder / FILE}    (codium, cursor and code-server take it alike)\n"
        'The language server is that of `dsl`: pip install "softmark[lsp]"\n'
        "The setting softmark.command gives the path of `dsl`, if it is not found.\n"
        "The setting softmark.plugins names the plugins to load."
    )


def contents() -> dict[str, bytes]:
    """Return the files of the `.vsix` archive by path."""
    made = {
        "[Content_Types].xml": _TYPES,
        "extension.vsixmanifest": _vsix_manifest(),
        "extension/package.json": _json(package()),
        "extension/language-configuration.json": _json(CONFIGURATION),
        "extension/client.js": CLIENT.read_text(encoding="utf-8"),
        "extension/readme.md": _README,
    }
    colours = textmate_grammar.files()[textmate_grammar.FILE]
    return {**{name: text.encode() for name, text in made.items()}, f"extension/{textmate_grammar.FILE}": colours}


CONFIGURATION = {
    "comments": {"lineComment": "#"},
    "brackets": [["(", ")"], ["[", "]"]],
    "autoClosingPairs": [
        {"open": "(", "close": ")"}, {"open": "[", "close": "]"},
        {"open": '"', "close": '"', "notIn": ["string", "comment"]},
    ],
    "surroundingPairs": [["(", ")"], ["[", "]"], ['"', '"']],
    "wordPattern": "[A-Za-z_]\\w*",
    "indentationRules": {"increaseIndentPattern": "[\\(\\[]\\s*(#.*)?$", "decreaseIndentPattern": "^\\s*[\\)\\]]"},
}  # fmt: skip


def package() -> dict[str, Any]:
    """Return the extension's package.json: its description and its contributions."""
    where = "The softmark command, with its path if it is not in the search path."
    command = {"type": "string", "default": "dsl", "scope": "machine-overridable", "description": where}
    files = (
        "Plugins whose words are known: Python files, relative to the open folder or with an absolute path, or names "
    )
    plugins = {
        "type": "array",
        "items": {"type": "string"},
        "default": [],
        "scope": "window",
        "description": f"{files}of installed ones. They are executed, so a folder is allowed to name some only if it "
        "is trusted.",
    }
    own = {
        "softmark.command": command,
        "softmark.plugins": plugins,
    }  # both settings make the extension run the code that they name
    trust = {
        "supported": "limited",
        "restrictedConfigurations": sorted(own),
        "description": "An untrusted folder can set neither the command nor plugins.",
    }
    language = {"id": LANGUAGE, "aliases": ["softmark scene"], "extensions": [".scene"],
                "configuration": "./language-configuration.json"}  # fmt: skip
    return {
        "name": "softmark", "displayName": "softmark", "publisher": "softmark", "version": __version__,
        "description": "softmark scenes: syntax highlighting, diagnostics, completion, hover text, formatting",
        "license": "Apache-2.0", "engines": {"vscode": "^1.75.0"}, "categories": ["Programming Languages"],
        "main": "./client.js", "activationEvents": [f"onLanguage:{LANGUAGE}"],
        "capabilities": {"untrustedWorkspaces": trust, "virtualWorkspaces": False},
        "contributes": {
            "languages": [language],
            "grammars": [{"language": LANGUAGE, "scopeName": "source.softmark", "path": f"./{textmate_grammar.FILE}"}],
            "commands": [{"command": f"softmark.{name}", "title": f"softmark: {name} this scene"} for name in COMMANDS],
            "configuration": {"title": "softmark", "properties": own},
        },
    }  # fmt: skip


def _json(value: Any) -> str:
    return json.dumps(value, indent=2, ensure_ascii=False) + "\n"


def _vsix_manifest() -> str:
    own = package()
    properties = {"Microsoft.VisualStudio.Code.Engine": own["engines"]["vscode"],
                  "Microsoft.VisualStudio.Code.ExtensionKind": "workspace"}  # fmt: skip
    said = "\n".join(f'      <Property Id="{name}" Value="{escape(value)}" />' for name, value in properties.items())
    return f"""\
<?xml version="1.0" encoding="utf-8"?>
<PackageManifest Version="2.0.0" xmlns="http://schemas.microsoft.com/developer/vsx-schema/2011"
  xmlns:d="http://schemas.microsoft.com/developer/vsx-schema-design/2011">
  <Metadata>
    <Identity Language="en-US" Id="{own["name"]}" Version="{own["version"]}" Publisher="{own["publisher"]}" />
    <DisplayName>{own["displayName"]}</DisplayName>
    <Description xml:space="preserve">{escape(own["description"])}</Description>
    <Categories>{own["categories"][0]}</Categories>
    <Properties>
{said}
    </Properties>
  </Metadata>
  <Installation><InstallationTarget Id="Microsoft.VisualStudio.Code" /></Installation>
  <Dependencies />
  <Assets>
    <Asset Type="Microsoft.VisualStudio.Code.Manifest" Path="extension/package.json" Addressable="true" />
    <Asset Type="Microsoft.VisualStudio.Services.Content.Details" Path="extension/readme.md" Addressable="true" />
  </Assets>
</PackageManifest>
"""


_TYPES = """\
<?xml version="1.0" encoding="utf-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
  <Default Extension=".json" ContentType="application/json" />
  <Default Extension=".vsixmanifest" ContentType="text/xml" />
  <Default Extension=".js" ContentType="application/javascript" />
  <Default Extension=".md" ContentType="text/markdown" />
</Types>
"""
_README = """\
# softmark

Scenes of softmark in the editor: colours, and what the language server `dsl lsp` says while you type. Install it with
`pip install "softmark[lsp]"`. The setting `softmark.command` says where `dsl` is, if it is not on the path of programs,
`softmark.plugins` which plugins' words are known. A folder that is not trusted chooses neither.
"""

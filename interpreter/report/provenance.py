"""What is needed to repeat the run, and what its numbers may depend on."""

from __future__ import annotations

import shlex

from softmark.grammar import tree
from softmark.interpreter.report.findings import Findings
from softmark.interpreter.report.markup import section, tag, text

WORDS = {
    "softmark": "softmark", "python": "Python", "numpy": "NumPy", "scipy": "SciPy", "numba": "Numba", "platform": "Platform",
    "cpu": "Processor", "threads": "Threads", "started": "Started (UTC)",
}  # fmt: skip


def section_of(findings: Findings) -> str:
    """The command, the digest and the environment."""
    scene = findings.report.scene
    known = [(WORDS.get(k, k), str(v)) for k, v in findings.report.environment.items()]
    solvers = sorted({str(s) for m in findings.report.models.values() if (s := m.solve.get("linear_solver"))})
    facts = [
        ("Scene", str(scene.get("file", "–"))), ("SHA-256 of its text", str(scene.get("sha256", "–"))), *known,
        *([("Linear solver", ", ".join(solvers))] if solvers else []),
    ]  # fmt: skip
    rows = [tag("tr", tag("th", text(name), scope="row"), tag("td", text(value))) for name, value in facts]
    table = tag("table", tag("caption", "Environment"), tag("tbody", *rows), class_="facts")
    lead = tag("p", "To repeat this run:")
    return section(
        "provenance",
        "Provenance",
        lead,
        tag("pre", tag("code", text(command(findings))), class_="command"),
        tag("div", table, class_="scroll"),
    )


def command(findings: Findings) -> str:
    """`dsl run FILE -p h=3mm --model rod`, quoted for a shell. A scene without a file is read from standard input."""
    scene = findings.report.scene
    file = str(scene.get("file", "-"))
    parts = ["dsl", "run", "-" if file.startswith("<") else file]
    for override in _overrides(findings):
        parts += ["-p", override]
    for name in _only(findings):
        parts += ["--model", name]
    return shlex.join(parts)


def _overrides(findings: Findings) -> list[str]:
    """As given on the command line where the report has that, else the parameters that it says were overridden."""
    scene = findings.report.scene
    given = scene.get("overrides")
    if given is not None:
        return [str(override) for override in given]
    parameters = scene.get("parameters") or {}
    return [f"{n}={parameters[n].get('text', '')}" for n in scene.get("overridden") or () if n in parameters]


def _only(findings: Findings) -> list[str]:
    """The models that were asked for, where the finished report has not all that the scene declares."""
    declared = {n for n, d in findings.declared.items() if isinstance(d, tree.Declare) and d.kind == "model"}
    run = list(findings.report.models)
    return run if not findings.report.partial and run and declared - set(run) else []

"""The report as a JUnit file, for continuous integration: a test case for each model, reference and expectation."""

from __future__ import annotations

from xml.etree import ElementTree

from softmark.interpreter.report.page.markup import legible
from softmark.interpreter.results.report import Report

FAILED = ("not_converged", "diverged", "failed")


def render(report: Report) -> str:
    """XML text: failures are expectations not met, errors what did not converge, skipped what was left out."""
    suite = ElementTree.Element("testsuite", name=str(report.scene["title"]))
    for outcome in report.outcomes:
        case = _case(suite, f"{outcome.name} converges", "softmark.models")
        if outcome.status in FAILED:
            ElementTree.SubElement(case, "error", message=outcome.message or outcome.status)
    for e in report.expectations:
        case = _case(suite, e.text, "softmark.expectations")
        if e.left_out:
            ElementTree.SubElement(case, "skipped", message=e.reason or "")
        elif not e.passed:
            number = "" if e.value is None else f"found {e.value} {e.unit}"
            found = "; ".join(filter(None, (e.reason, number)))
            ElementTree.SubElement(case, "failure", message=f"line {e.line}: {e.text}: {found}")
    for kind, tag in (("errors", "error"), ("failures", "failure"), ("skipped", "skipped")):
        suite.set(kind, str(len(suite.findall(f"*/{tag}"))))
    suite.set("tests", str(len(suite)))
    for element in suite.iter():  # texts that scenes and files brought: XML has no control characters
        element.attrib = {name: legible(value) for name, value in element.attrib.items()}
    ElementTree.indent(suite)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(suite, encoding="unicode") + "\n"


def _case(suite: ElementTree.Element, name: str, group: str) -> ElementTree.Element:
    return ElementTree.SubElement(suite, "testcase", name=name, classname=group)

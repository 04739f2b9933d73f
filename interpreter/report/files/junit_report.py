"""Report as a JUnit file for continuous integration: one test case per model, reference and expectation.

Numbers are `<properties>`, which tools can plot over builds. An expectation has its metric, value, unit, relation,
limit, stated error, uncertainty and reference. A model or reference has for each metric its value, and under the names
`METRIC.unit`, `METRIC.stated_error`, `METRIC.uncertainty` and `METRIC.reference` the other facts. The test suite has
the facts on which the numbers depend, such as versions.
"""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree

from softmark.interpreter.report.page.html_markup import legible
from softmark.interpreter.results.run_report import (
    ExpectationResult,
    MetricResult,
    ModelResult,
    ReferenceResult,
    Report,
)


def render(report: Report) -> str:
    """Return the report as JUnit XML.

    Failures are expectations that are not met, errors are models without a converged solution, skipped tests are
    omitted models.
    """
    suite = ElementTree.Element("testsuite", name=str(report.scene["title"]))
    _properties(suite, _suite_properties(report))
    failures = report.failures
    for outcome in report.outcomes:
        case = _add_test_case(suite, f"{outcome.name} converges", "softmark.models")
        _properties(case, _result_properties(report, outcome))
        if outcome in failures:
            ElementTree.SubElement(case, "error", message=outcome.message or outcome.status)
    for e in report.expectations:
        case = _add_test_case(suite, e.text, "softmark.expectations")
        _properties(case, _expectation_properties(report, e))
        if e.left_out:
            ElementTree.SubElement(case, "skipped", message=e.reason or "")
        elif not e.passed:
            number = "" if e.value is None else f"found {e.value} {e.unit}"
            found = "; ".join(filter(None, (e.reason, number)))
            ElementTree.SubElement(case, "failure", message=f"line {e.line}: {e.text}: {found}")
    for kind, tag in (("errors", "error"), ("failures", "failure"), ("skipped", "skipped")):
        suite.set(kind, str(len(suite.findall(f"testcase/{tag}"))))
    suite.set("tests", str(len(suite.findall("testcase"))))
    for element in suite.iter():  # texts that scenes and files brought: XML has no control characters
        element.attrib = {name: legible(value) for name, value in element.attrib.items()}
    ElementTree.indent(suite)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(suite, encoding="unicode") + "\n"


def _add_test_case(suite: ElementTree.Element, name: str, group: str) -> ElementTree.Element:
    return ElementTree.SubElement(suite, "testcase", name=name, classname=group)


def _properties(element: ElementTree.Element, known: Mapping[str, object]) -> None:
    """Add properties to an XML element, except those that are None or empty."""
    if told := {name: value for name, value in known.items() if value not in (None, "")}:
        box = ElementTree.SubElement(element, "properties")
        for name, value in told.items():
            ElementTree.SubElement(box, "property", name=name, value=str(value))


def _suite_properties(report: Report) -> dict[str, object]:
    scene, machine = report.scene, report.environment
    own = {"scene": scene.get("file"), "scene.sha256": scene.get("sha256")}
    own |= {f"parameter.{name}": p["text"] for name, p in (scene.get("parameters") or {}).items()}
    return own | {name: machine.get(name) for name in ("softmark", "python", "platform", "cpu")}


def _result_properties(report: Report, outcome: ModelResult | ReferenceResult) -> dict[str, object]:
    own: dict[str, object] = {"status": outcome.status}
    for name, metric in outcome.metrics.items():
        told = _metric_properties(report, outcome, name, metric)
        own |= {name: told.pop("value"), **{f"{name}.{key}": value for key, value in told.items()}}
    return own


def _metric_properties(
    report: Report, outcome: ModelResult | ReferenceResult, name: str, metric: MetricResult
) -> dict[str, object]:
    stated = outcome.stated.get(name) if isinstance(outcome, ModelResult) else None
    known = report.names.declared.get(name)
    return {
        "value": metric.value,
        "unit": metric.unit,
        "stated_error": stated.value if stated else None,
        "uncertainty": metric.uncertainty,
        "reference": known.against if known else None,
    }


def _expectation_properties(report: Report, e: ExpectationResult) -> dict[str, object]:
    owner, _, name = e.metric.partition(".")
    outcome = report.models.get(owner) or report.references.get(owner)
    metric = outcome.metrics.get(name) if outcome else None
    about = _metric_properties(report, outcome, name, metric) if outcome and metric else {}
    own = {"line": e.line, "metric": e.metric, "value": e.value, "unit": e.unit}
    compared = {"relation": " ".join(e.relations), "limit": " ".join(map(str, e.limits))}
    return {**own, **compared, **{key: about[key] for key in about if key not in own}}

"""Assignment of models, references, metrics and shapes to bodies; each body gets a comparison of its own."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import field

from softmark.interpreter.report.page.html_markup import join_names
from softmark.interpreter.report.run.report_summary import UNKNOWN, MetricColumn, ReportSummary, Result
from softmark.records import dataclass


@dataclass(frozen=True)
class BodyResults:
    """Names of the results and metrics of one body; `name` is empty if they are not separated by body."""

    name: str
    results: tuple[str, ...]
    metrics: tuple[MetricColumn, ...]


def bodies(findings: ReportSummary) -> tuple[BodyResults, ...]:
    """Return the results of each body, in the order of the report.

    If bodies cannot be distinguished, return one entry without a name. A metric without a body, such as a time,
    belongs to all bodies.
    """
    links, everyone = (
        _group_linked_names(findings),
        [n for n, r in findings.all_results.items() if not _is_given_value(r)],
    )
    groups: dict[str, list[str]] = {}
    for name in everyone:
        groups.setdefault(links.root(f"result {name}"), []).append(name)
    if len(groups) < 2 or len(_declared_bodies(findings)) < 2:
        return (BodyResults("", tuple(everyone), findings.metrics),)
    return tuple(
        BodyResults(_group_name(findings, links, root), tuple(names), tuple(_metrics_of_group(findings, links, root)))
        for root, names in groups.items()
    )


def _is_given_value(result: Result) -> bool:
    """Return whether a result is a value given in the scene, which is shown next to the results compared with it."""
    return "value" in getattr(result, "facts", {})


@dataclass
class _Links:
    """Groups of connected names, as a union-find structure."""

    parent: dict[str, str] = field(default_factory=dict)

    def root(self, thing: str) -> str:
        while (above := self.parent.setdefault(thing, thing)) != thing:
            thing = above
        return thing

    def join(self, a: str, b: str) -> None:
        self.parent[self.root(a)] = self.root(b)


def _group_linked_names(findings: ReportSummary) -> _Links:
    links = _Links()
    for name, result in findings.all_results.items():
        own = list(_names_linked_to_result(findings, name, result))
        for thing in own or list(_users_of_measured_data(findings, name)):
            links.join(f"result {name}", thing)
    for metric in findings.metrics:
        if metric.probe is not None:
            links.join(f"metric {metric.name}", f"probe {metric.probe}")
    for probe in {m.probe for m in findings.metrics} | set(findings.probes):
        if (body := _body_of(findings, probe or "")) is not None:
            links.join(f"probe {probe}", f"body {body}")
    return links


def _names_linked_to_result(findings: ReportSummary, name: str, result: Result) -> Iterator[str]:
    """Yield the names that connect a result to its body: its probes, its declared body, its metrics."""
    yield from (f"probe {probe}" for probe in result.probes)
    if (body := _body_of(findings, name)) is not None:
        yield f"body {body}"
    about = {m.name for m in findings.metrics if m.probe is not None}
    yield from (f"metric {metric}" for metric in result.metrics if metric in about)


def _users_of_measured_data(findings: ReportSummary, name: str) -> Iterator[str]:
    """Yield the metrics and results that use measured data, which have no body of their own."""
    yield from (f"metric {m.name}" for m in findings.metrics if m.against == name and m.probe is not None)
    for other, result in findings.all_results.items():
        if result.shape is not None and result.shape.measured_from == name:
            yield f"result {other}"


def _declared_bodies(findings: ReportSummary) -> list[str]:
    return findings.report.names.of_kind("body")


def _body_of(findings: ReportSummary, name: str) -> str | None:
    """Return the body that the declaration of a name refers to, or None."""
    return findings.declared.get(name, UNKNOWN).body


def _group_name(findings: ReportSummary, links: _Links, root: str) -> str:
    """Return the name of the body of a group, such as `beam`; several names if bodies share their references."""
    found = [name for name in _declared_bodies(findings) if links.root(f"body {name}") == root]
    return join_names(found) or "the rest"


def _metrics_of_group(findings: ReportSummary, links: _Links, root: str) -> Iterable[MetricColumn]:
    return (m for m in findings.metrics if m.probe is None or links.root(f"metric {m.name}") == root)

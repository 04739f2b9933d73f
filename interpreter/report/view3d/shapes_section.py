"""Figure of every deformed shape under one camera, with its error as colour.

Source: Marchal et al. (2008), figure 2.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.number_formatting import choose_scale, format_quantity, group_digits, typeset_number
from softmark.interpreter.report.charts.line_chart import legend_sample_svg
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link, round_for_drawing
from softmark.interpreter.report.page.figure_frame import SHOWN, ColumnGroup, data_table, details, hidden_models_note
from softmark.interpreter.report.page.html_markup import (
    count,
    join_few_names,
    prose,
    section,
    strip_backticks,
    tag,
    text,
)
from softmark.interpreter.report.run.report_bodies import bodies
from softmark.interpreter.report.run.report_summary import ReportSummary, Result
from softmark.interpreter.report.run.tables.line_probes import curve_styles, initially_shown
from softmark.interpreter.report.view3d import rigid_bodies_view
from softmark.interpreter.report.view3d.compact_surfaces import (
    POINTS,
    ROOM,
    Floats,
    ReducedSurfaces,
    largest_rounding_step,
    notes_of,
    pack_surface,
    packed_triangles,
    reduce_surfaces,
)
from softmark.interpreter.report.view3d.shapes_toolbar import DECADES, FigureKind, colour_bar, time_bar, toolbar
from softmark.interpreter.report.view3d.still_picture import CameraView, render_still, seen_box
from softmark.interpreter.report.view3d.view_camera import letters, view_of
from softmark.interpreter.results.run_report import DrawnSurface
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.report.view3d.surface_fields import FieldColours

PANELS = 24  # with more shapes than this only some models are shown initially
CLIP = 95.0  # percentile of the points of one shape
FAR = 3.0  # a shape with errors this many times larger than typical ones does not determine the colour scale
STAGE = "Shapes of all models. Arrow keys rotate, plus and minus zoom, 0 resets the view, space plays."
STATISTICS = ("mean", "median", "95 %", "largest")


def section_of(findings: ReportSummary, points: int = POINTS, room: int = ROOM, stills: bool = True) -> str:
    """Return the HTML section with the figure; empty without shapes.

    Surfaces have at most `points` points and take about `room` bytes. With `stills` there are still pictures for
    readers without scripts.
    """
    given = {n: r.shape for n, r in _references_first(findings) if r.shape is not None and _is_drawable(r.shape)}
    if not given:
        return ""
    kept, figures = reduce_surfaces(given, points, room).shapes, []
    for number, body in enumerate(bodies(findings)):
        own = {n: shape for n, shape in kept.items() if n in body.results}
        if own:
            small = ReducedSurfaces(own, tuple(notes_of({n: given[n] for n in own}, own)))
            figures.append(_Shapes(findings, small, f"-{number}" if number else "", body.name, stills).figure())
    return section("shapes", "Shapes", *figures)


def _references_first(findings: ReportSummary) -> Iterator[tuple[str, Result]]:
    """Yield the names and results of all references, and then those of all models."""
    yield from findings.report.references.items()
    yield from findings.report.models.items()


def _is_drawable(shape: DrawnSurface) -> bool:
    """Return whether a surface has triangles and only finite positions."""
    known = bool(np.isfinite(shape.position).all())
    return known and len(shape.triangles) > 0 and (shape.frames is None or bool(np.isfinite(shape.frames).all()))


@dataclass(frozen=True)
class _Shapes:
    """Figure of the deformed surfaces of all models and references, each surface with its errors as colours.

    Errors are the distances, m, between points of a surface and those of the reference. Dictionaries have the name of
    the model or reference as key.
    """

    findings: ReportSummary
    small: ReducedSurfaces
    key: str = ""  # suffix of the element ids
    body: str = ""
    stills: bool = True  # pictures for readers without scripts

    @property
    def shapes(self) -> Mapping[str, DrawnSurface]:
        """Surfaces as drawn, by model or reference."""
        return self.small.shapes

    @cached_property
    def errors(self) -> dict[str, Floats]:
        """Distances to the reference (n,), m, at all n surface points of each model or reference, by its name.

        The 3D view may draw fewer points; the statistics use all.
        """
        shapes = ((n, self.findings.all_results[n].shape) for n in self.shapes)
        return {n: s.error for n, s in shapes if s is not None and s.error is not None and len(s.error)}

    @cached_property
    def most(self) -> float:
        """Largest error of all deformed surfaces in the figure, m."""
        return max((float(e.max()) for e in self.errors.values()), default=0.0)

    @cached_property
    def high(self) -> dict[str, float]:
        """Error, m, that CLIP per cent of the points of a surface do not exceed, for each model or reference."""
        return {n: float(np.percentile(e, CLIP)) for n, e in self.errors.items()}

    @cached_property
    def typical_error_limit(self) -> float:
        """Upper end of the colour scale of typical errors, m; surfaces with FAR times larger errors are ignored."""
        usual = FAR * float(np.median(list(self.high.values()))) if self.high else 0.0
        return max((h for h in self.high.values() if h <= usual), default=self.most)

    @cached_property
    def names_beyond_scale(self) -> list[str]:
        """Names of the models and references whose errors are far beyond the typical ones."""
        return [n for n, h in self.high.items() if h > FAR / 2 * self.typical_error_limit]

    @cached_property
    def first(self) -> dict[str, DrawnSurface]:
        """Surfaces that are shown initially: all if they are few, else references and initially shown models."""
        if len(self.shapes) <= PANELS:
            return dict(self.shapes)
        models, chosen = self.findings.report.models, initially_shown(self.findings)
        best = [n for n in chosen if n in self.shapes] or [n for n in self.shapes if n in models][:SHOWN]
        return {n: s for n, s in self.shapes.items() if n in best or n not in models}

    @cached_property
    def view(self) -> CameraView:
        """Initial camera view of the figure."""
        return view_of(self.findings, self.shapes.values())

    @cached_property
    def against(self) -> str:
        """Name of the reference of the shown errors, as text; `its reference` if there are several."""
        names = list(dict.fromkeys(s.measured_from for s in self.shapes.values() if s.measured_from))
        return f"`{names[0]}`" if len(names) == 1 else "its reference"

    @cached_property
    def dynamic(self) -> bool:
        """True if a surface has several frames, one for each time or state."""
        return any(s.frames is not None for s in self.shapes.values())

    @cached_property
    def carried(self) -> FieldColours | None:
        """Stress, strain and contact fields as colours; None if no result has them."""
        given = {n: s for n in self.shapes if (s := self.findings.all_results[n].shape) is not None}
        if not any(c.values is not None for s in given.values() for c in s.carried):
            return None
        from softmark.interpreter.report.view3d.surface_fields import FieldColours

        return FieldColours(given, self.shapes, _stress_moment_phrase(self.dynamic, self.in_states))

    @property
    def in_states(self) -> bool:
        """True if the frames show states of a static analysis, not times."""
        return any(s.labels for s in self.shapes.values())

    def figure(self) -> str:
        """Return the HTML of the figure: controls, pictures, colour bar, caption and numbers."""
        bar = (
            colour_bar(self.most, self.typical_error_limit, f"distance from {strip_backticks(self.against)}")
            if self.errors
            else ""
        )
        unknown = tag(
            "p",
            f"{'Errors and fields' if self.carried else 'Errors'} are available only "
            f"{'in the last state' if self.in_states else 'at the end'}; until then, colours distinguish models.",
            class_="unknown quiet",
            hidden=True,
        )
        carried = self.carried
        numbers = details(
            "Data of this figure", data_table("Data: errors of the shapes", self._columns()), self._csv_link()
        )
        caption = tag("figcaption", tag("p", prose(self._caption())), numbers)
        kind = FigureKind(self.key, bool(self.names_beyond_scale), letters(self.view))
        words = carried.words if carried else ()
        controls = toolbar(
            self._shape_entries(),
            bool(self.errors),
            len(self.first) <= PANELS,
            self._background_references(),
            kind,
            words,
        )
        time = time_bar("State" if self.in_states else "Time") if self.dynamic else ""
        spoken = tag("div", class_="spoken", aria_live="polite")
        bar += carried.bars() if carried else ""
        bar += carried.still(self.first, self.view, self.key) if carried and self.stills else ""
        heading = tag("h3", prose(f"`{self.body}`")) if self.body else ""
        return heading + tag(
            "figure",
            controls,
            self._shape_panels(),
            self._still_picture(),
            time,
            bar,
            unknown,
            spoken,
            caption,
            self._script_data(),
            class_="shapes",
            id=f"figure-shapes{self.key}",
        )

    def _shape_entries(self) -> list[tuple[str, str, str, bool]]:
        """Return (name, colour sample, CSS classes, shown initially) of each shape."""
        known = curve_styles(self.findings.report)
        return [(n, legend_sample_svg(known[n]), known[n].classes, n in self.first) for n in self.shapes]

    def _background_references(self) -> list[tuple[int, str, bool]]:
        """Return (index, name, initially drawn behind the others) of each reference."""
        references = self.findings.report.references
        found = [(i, n) for i, n in enumerate(self.shapes) if n in references]
        usual = next((n for _, n in found if f"`{n}`" == self.against), found[0][1] if found else "")
        return [(i, n, n == usual) for i, n in found]

    # -------------------------------------------------------------- pictures

    def _shape_panels(self) -> str:
        low, high = seen_box(self.shapes, self.view)
        width, height = (float(v) + 0.04 * float((high - low).max()) for v in high - low)
        aspect = min(2.2, max(0.8, width / height if height > 0 else 2.2))
        panels = tag("div", *(self._panel(*known) for known in self._shape_entries()), class_="panels")
        everyone = tag(
            "canvas",
            class_="all",
            role="img",
            aria_label=strip_backticks(f"All shapes, superimposed. {self._ranking()}"),
        )
        columns = _panel_column_count(len(self.first))
        return tag(
            "div", panels, everyone, class_="stage", tabindex=0, role="group", aria_label=STAGE,
            style=f"--aspect:{aspect:.3f};--columns:{columns};--narrow:{min(columns, 2)}",
        )  # fmt: skip

    def _panel(self, name: str, drawn: str, classes: str, shown: bool) -> str:
        said = self._error_text(name)
        canvas = tag("canvas", role="img", aria_label=strip_backticks(f"{name}: {said or 'deformed shape'}"))
        label = tag("p", drawn, tag("b", text(name)), tag("small", text(said)) if said else "")
        return tag("div", canvas, label, class_=f"panel {classes}", data_shown="yes" if shown else "no")

    def _error_text(self, name: str) -> str:
        """Return mean and largest error of a shape as text."""
        error = self.errors.get(name)
        if error is None:
            reference = self.findings.report.references.get(name)
            return reference.about if reference else ""
        mean, largest = (format_quantity(float(e), "m", 3) for e in (error.mean(), error.max()))
        return f"mean {mean}, largest {largest}"

    def _still_picture(self) -> str:
        words = "Deformed shapes", f"{self._ranking()} {self._error_texts()}"
        top = self.typical_error_limit if self.names_beyond_scale else self.most
        if not self.stills or (self.carried and not self.errors):
            return ""
        return tag("noscript", render_still(self.first, self.view, top, words, f"shapes{self.key}"))

    def _script_data(self) -> str:
        """Return the JSON that `shapes.js` reads."""
        meshes: dict[bytes, int] = {}
        packs, triangles = [], []
        for name, shape in self.shapes.items():
            key = shape.triangles.tobytes()
            if key not in meshes:
                meshes[key] = len(meshes)
                triangles.append(packed_triangles(shape.triangles))
            packs.append(pack_surface(name, shape, meshes[key]) | (self.carried.packed(name) if self.carried else {}))
        beside: dict[str, Any] = {}
        if any(shape.instruments for shape in self.shapes.values()):
            beside, places = rigid_bodies_view.packed_instruments(self.shapes)
            packs = [pack | places[name] for name, pack in zip(self.shapes, packs, strict=True)]
        data = (
            {
                "view": (self.view.turn, self.view.tilt),
                "frame": self.view.frame.tolist(),
                "most": self.most,
                "clipped": self.typical_error_limit,
                "decades": DECADES,
                "meshes": triangles,
                "shapes": packs,
            }
            | ({"carried": self.carried.data()} if self.carried else {})
            | beside
        )
        return tag("script", json.dumps(data).replace("<", "\\u003c"), type="application/json")

    # -------------------------------------------------------------- words

    def _error_texts(self) -> str:
        return "; ".join(f"{n}: {said}" for n in self.shapes if (said := self._error_text(n))) + "."

    def _ranking(self) -> str:
        """Return a sentence on the shapes with the smallest and the largest error."""
        means = {n: float(e.mean()) for n, e in self.errors.items() if n in self.findings.report.models}
        if not means:
            return f"{count(len(self.shapes), 'shape')}, without errors."
        least, most = min(means, key=lambda n: means[n]), max(means, key=lambda n: means[n])
        said = f"On average `{least}` is {format_quantity(means[least], 'm', 3)} from {self._reference_of_shape(least)}"
        rest = f", `{most}` {format_quantity(means[most], 'm', 3)}" if most != least else ""
        return f"{said}{rest}."

    def _reference_of_shape(self, name: str) -> str:
        return f"`{against}`" if (against := self.shapes[name].measured_from) else "its reference"

    def _caption(self) -> str:
        seen = "All shapes have the same view and scale; drag to rotate them."
        colour = ""
        if self.errors:
            colour = (
                f" Colour is the distance from {self.against}, with the same scale for all.{self._clipping_sentence()}"
            )
        models = self.findings.report.models
        bare = [f"`{n}`" for n in self.shapes if self.errors and n not in self.errors and n in models]
        plainly = f" {join_few_names(bare)} {'has' if len(bare) == 1 else 'have'} no error to show." if bare else ""
        step = format_quantity(largest_rounding_step(self.shapes), "m", 2)
        if self.carried:
            plainly += self.carried.caption(bool(self.errors))
        moment = "" if not self.dynamic else " in each state" if self.in_states else " at every moment"
        plainly += rigid_bodies_view.caption(self.shapes.values(), moment)
        notes = " ".join(["", *self.small.notes])
        total, first = (len([n for n in known if n in models]) for known in (self.shapes, self.first))
        shown = hidden_models_note(total, first, "boxes")
        return f"{self._ranking()} {seen}{colour}{plainly} On this page positions are rounded to {step}.{notes}{shown}"

    def _clipping_sentence(self) -> str:
        """Return a sentence on the shapes whose errors are beyond the scale of typical errors."""
        if not self.names_beyond_scale:
            return ""
        names, clip = (
            join_few_names([f"`{n}`" for n in self.names_beyond_scale]),
            format_quantity(self.typical_error_limit, "m", 3),
        )
        one = len(self.names_beyond_scale) == 1
        return f" It ends at {clip}, so that typical errors can be distinguished; {names} exceed{'s' * one} this."

    # -------------------------------------------------------------- numbers

    def _columns(self) -> list[ColumnGroup]:
        scale = choose_scale((self.most,), "m")
        names = [(n,) for n in self.shapes]
        sizes = [(group_digits(len(s.position)), group_digits(len(s.triangles))) for s in self._full_surfaces]
        cells = []
        for n in self.shapes:
            found = _error_statistics(self.errors[n]) if n in self.errors else ()
            cells.append(tuple(typeset_number(f"{v / scale.factor:.4g}") for v in found) or ("–",) * len(STATISTICS))
        heads = tuple(scale.heading(s) for s in STATISTICS)
        return [
            ColumnGroup("shape", ("shape",), names),
            ColumnGroup("size", ("points", "triangles"), sizes),
            ColumnGroup("error", heads, cells),
            *(self.carried.columns() if self.carried else ()),
        ]

    @property
    def _full_surfaces(self) -> list[DrawnSurface]:
        return [s for n in self.shapes if (s := self.findings.all_results[n].shape) is not None]

    def _csv_link(self) -> str:
        header = ["name", "points", "triangles", "measured from", *(f"{s} error [m]" for s in STATISTICS)]
        header += self.carried.header() if self.carried else []
        rows: list[list[Cell]] = []
        for name, shape in zip(self.shapes, self._full_surfaces, strict=True):
            found: list[Cell] = [None] * len(STATISTICS)
            if name in self.errors:
                found = [round_for_drawing(v) for v in _error_statistics(self.errors[name])]
            rows.append([name, len(shape.position), len(shape.triangles), shape.measured_from, *found])
            rows[-1] += self.carried.row(name) if self.carried else []
        button = tag("button", "CSV of all points, as drawn now", type="button", class_="points live")
        return csv_link(f"shapes-errors{self.key}", header, rows) + button


def _stress_moment_phrase(dynamic: bool, in_states: bool) -> str:
    """Return a phrase on the time or state at which stress is shown for moving shapes."""
    return ("in the last state" if in_states else "at the last moment") if dynamic else ""


def _panel_column_count(panels: int) -> int:
    """Return the number of columns of panels that leaves few gaps in the last row."""
    return panels if panels <= 4 else 3 if panels in (5, 6, 9) else 5 if panels > 16 else 4


def _error_statistics(error: Floats) -> tuple[float, ...]:
    """Return mean, median, 95th percentile and largest of some errors, m."""
    return float(error.mean()), float(np.median(error)), float(np.percentile(error, 95.0)), float(error.max())

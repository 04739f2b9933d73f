"""Stress, strain and contact fields as colours of shapes, if a scene requests them; all models share one scale."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from softmark.interpreter.language.number_formatting import choose_scale, format_quantity
from softmark.interpreter.report.charts.chart_axes import linear
from softmark.interpreter.report.page.embedded_csv import Cell, round_for_drawing
from softmark.interpreter.report.page.figure_frame import ColumnGroup
from softmark.interpreter.report.page.html_markup import join_few_names, tag
from softmark.interpreter.report.view3d.compact_surfaces import Floats, encode_16_bits
from softmark.interpreter.report.view3d.shapes_toolbar import colour_strip, scale_below
from softmark.interpreter.report.view3d.still_picture import CameraView, render_still
from softmark.interpreter.results.run_report import DrawnSurface, RequestedSurfaceValues
from softmark.records import dataclass

USUAL = 95.0  # per cent of the points of each shape that the initial scale covers
FAR = 3.0  # a shape with values this many times larger than typical ones does not determine the colour scale
FLAT = 1e-6  # smaller ranges, relative to the size of the tensors, are rounding and get one colour
ENDS = " (the end colours include all larger or smaller values)"
STATISTICS = ("least", "mean", "largest")


@dataclass(frozen=True)
class FieldScale:
    """Colour scale of one field, shared by all models.

    `whole` has its ends for all points, `usual` for typical values.
    """

    kind: RequestedSurfaceValues
    whole: tuple[float, float]
    usual: tuple[float, float]

    def amount(self, value: float) -> str:
        """Return a value of the field as text, with enough digits to distinguish the ends of the scale."""
        low, high = self.whole
        digits = 3 if high - low > 0.02 * max(abs(low), abs(high)) else 6
        return format_quantity(value, self.kind.unit, digits, percent=True)


def scale_over(numbers: list[RequestedSurfaceValues]) -> FieldScale | None:
    """Return the colour scale of a field over several models; None if no model has it."""
    known = [n.values for n in numbers if n.values is not None and len(n.values)]
    if not known:
        return None
    least, most = min(float(v.min()) for v in known), max(float(v.max()) for v in known)
    tails = [(0.5 * (100.0 - USUAL), 0.5 * (100.0 + USUAL))] * len(known)
    usual_of = [_values_for_typical_range(v) for v in known] if numbers[0].partly else known
    ends = [tuple(float(e) for e in np.percentile(v, tail)) for v, tail in zip(usual_of, tails, strict=True)]
    sizes = [max(abs(low), abs(high)) for low, high in ends]
    usual = [e for e, size in zip(ends, sizes, strict=True) if size <= FAR * float(np.median(sizes))]
    floor = FLAT * max(n.size for n in numbers) or 1e-12
    low, high = min(low for low, _ in usual), max(high for _, high in usual)
    return FieldScale(numbers[0], _separate_ends(least, most, floor), _separate_ends(low, high, floor))


def _values_for_typical_range(values: Floats) -> Floats:
    """Return the nonzero values (n,) and a few zeros, so that zero is an end of the range of typical values."""
    some = values[values != 0.0]
    return np.concatenate([np.zeros(2 + len(some) // 10), some]) if len(some) else values


def _separate_ends(low: float, high: float, floor: float) -> tuple[float, float]:
    """Return the ends of a scale, moved apart if they differ only by rounding errors."""
    if high - low > floor:
        return low, high
    middle, half = 0.5 * (low + high), max(0.05 * abs(low + high), floor)
    return middle - half, middle + half


@dataclass(frozen=True)
class FieldColours:
    """Stress, strain and contact fields that a figure can show as colour, with their scales.

    `given` are the surfaces with all points of the results, and `shapes` the reduced surfaces that the page
    draws.
    """

    given: Mapping[str, DrawnSurface]
    shapes: Mapping[str, DrawnSurface]
    when: str  # phrase on the time or state at which fields of moving shapes are known

    @cached_property
    def models(self) -> dict[str, DrawnSurface]:
        """Surfaces of the models that have fields, by the name of the model."""
        return {n: s for n, s in self.given.items() if s.carried}

    @cached_property
    def known(self) -> dict[int, FieldScale]:
        """Colour scales of the available fields, by the index of the requested field."""
        asked = range(max((len(s.carried) for s in self.models.values()), default=0))
        found = ((i, scale_over([s.carried[i] for s in self.models.values()])) for i in asked)
        return {i: scale for i, scale in found if scale is not None}

    @property
    def places(self) -> list[int]:
        """Indices of the available fields among the requested fields."""
        return list(self.known)

    @property
    def scales(self) -> list[FieldScale]:
        """Colour scales of the available fields."""
        return list(self.known.values())

    @property
    def words(self) -> list[str]:
        """Descriptions of the available fields."""
        return [scale.kind.words for scale in self.scales]

    def bars(self) -> str:
        """Return the HTML of a colour bar for each field and both ranges; a script shows the chosen one."""
        found = []
        for i, scale in enumerate(self.scales):
            ranges = _colour_bar_scale(scale, scale.whole, "whole", "") + _colour_bar_scale(
                scale, scale.usual, "usual", ENDS
            )
            bar = tag("div", colour_strip(), ranges, class_="colour-bar carried live", data_number=i, hidden=i > 0)
            found.append(bar)
        return "".join(found)

    def still(self, first: Mapping[str, DrawnSurface], view: CameraView, key: str) -> str:
        """Return a still picture of the first field with its colour bar, for readers without scripts."""
        scale = self.scales[0]
        low, high = scale.usual
        shown = {n: _with_field_colours(s, self.places[0], low) for n, s in first.items() if s.carried}
        words = f"Deformed shapes, by {scale.kind.words}", " ".join(self._range_sentence(n) for n in shown)
        bar = tag("div", colour_strip(), _colour_bar_scale(scale, scale.usual, "", ENDS), class_="colour-bar")
        picture = render_still(shown, view, high - low, words, f"shapes{key}-carried") if shown else ""
        return tag("noscript", picture, bar)

    def _range_sentence(self, name: str) -> str:
        return f"{name}: {self._range(name, 0)}."

    def _range(self, name: str, place: int) -> str:
        """Return the smallest and largest value of a field on a shape as text."""
        values, scale = self.given[name].carried[self.places[place]].values, self.scales[place]
        if values is None:
            return f"no {scale.kind.words}"
        ends = (scale.amount(float(v)) for v in (values.min(), values.max()))
        return " to ".join(dict.fromkeys(ends))

    def data(self) -> list[dict[str, Any]]:
        """Return the scales as JSON that `carried.js` reads."""
        found = []
        for scale in self.scales:
            ratio = scale.kind.unit == "1"
            shown = choose_scale(scale.whole, scale.kind.unit, percent=ratio)
            named = {"words": scale.kind.words, "unit": scale.kind.unit, "whole": scale.whole, "usual": scale.usual}
            found.append(named | {"factor": shown.factor, "symbol": shown.unit})
        return found

    def packed(self, name: str) -> dict[str, Any]:
        """Return the field values of a shape as JSON, in 1/65535 of their range."""
        if name not in self.models:
            return {}
        found: list[dict[str, Any] | None] = []
        for place, i in enumerate(self.places):
            values = self.shapes[name].carried[i].values
            if values is None:
                found.append(None)
                continue
            low, high = float(values.min()), float(values.max())
            shares = encode_16_bits((values - low) / ((high - low) or 1.0))
            found.append({"values": shares, "low": low, "high": high, "said": self._range(name, place)})
        return {"carried": found}

    def caption(self, errors: bool) -> str:
        """Return sentences on the meaning of the colours, models without data, and limitations.

        `errors` is true if colours can also show errors.
        """
        asked = []
        for scale in self.scales:
            by = join_few_names([f"`{m}`" for m in scale.kind.metrics])
            asked.append(f"{scale.kind.words} (metric{'s' if len(scale.kind.metrics) > 1 else ''} {by})")
        said = " Colour can also be " if errors else " Colour is one of " if len(asked) > 1 else " Colour is "
        said += (
            f"{join_few_names(asked)}, recovered at the points of the surface{f', {self.when}' if self.when else ''},"
        )
        said += f" with the same scale for all models: at first it covers {USUAL:.0f}\u00a0% of the points of each."
        return said + "".join(
            f" {sentence}"
            for sentence in (
                *self._missing_field_sentences(),
                *self._singular_stress_sentences(),
                *self._stress_jump_sentences(),
            )
        )

    def _missing_field_sentences(self) -> Iterator[str]:
        reasons: dict[tuple[str, str], list[str]] = {}
        for name, shape in self.models.items():
            for number in shape.carried:
                if number.reason is not None:
                    every = all(n.reason == number.reason for n in shape.carried)
                    reasons.setdefault((number.reason, "" if every else number.words), []).append(f"`{name}`")
        for (reason, words), names in reasons.items():
            who = join_few_names(list(dict.fromkeys(names)))
            yield f"No colours for {who}{f', {words}' if words else ''}: {reason}."

    def _singular_stress_sentences(self) -> Iterator[str]:
        for place in dict.fromkeys(n.limitless for s in self.models.values() for n in s.carried if n.limitless):
            yield f"At {place} stress is singular (W388): colours there depend on the mesh."

    def _stress_jump_sentences(self) -> Iterator[str]:
        for name, shape in self.models.items():
            share = max(n.apart for n in shape.carried)
            if share > 0.0:
                percent = f"{max(1, round(100 * share))}\u00a0%"
                yield f"Stresses of adjacent cells of `{name}` differ at {percent} of the points (W387)."

    def columns(self) -> list[ColumnGroup]:
        """Return columns of the table with smallest, mean and largest value of each field."""
        found = []
        for i, scale in self.known.items():
            unit = choose_scale(scale.whole, scale.kind.unit, percent=scale.kind.unit == "1")
            rows = [self._statistics(n, i) for n in self.given]
            cells = [tuple("–" if v is None else unit.text(v, 4) for v in row) for row in rows]
            found.append(ColumnGroup(scale.kind.words, tuple(unit.heading(s) for s in STATISTICS), cells))
        return found

    def header(self) -> list[str]:
        """Return the headers of the field columns in the CSV file."""
        return [f"{s} {scale.kind.words} [{scale.kind.unit}]" for scale in self.scales for s in STATISTICS]

    def row(self, name: str) -> list[Cell]:
        """Return the field values of a shape, SI, for its row in the CSV file."""
        found = (v for i in self.places for v in self._statistics(name, i))
        return [None if v is None else round_for_drawing(v) for v in found]

    def _statistics(self, name: str, i: int) -> tuple[float | None, float | None, float | None]:
        carried = self.given[name].carried
        values: Floats | None = carried[i].values if carried else None
        if values is None:
            return None, None, None
        return float(values.min()), float(values.mean()), float(values.max())


def _colour_bar_scale(scale: FieldScale, ends: tuple[float, float], kind: str, words: str) -> str:
    return scale_below(linear(*ends, scale.kind.words, scale.kind.unit, 6), kind, words)


def _with_field_colours(shape: DrawnSurface, i: int, low: float) -> DrawnSurface:
    """Return a shape whose errors are replaced by the field values minus `low`, for the still picture."""
    values = shape.carried[i].values
    return replace(shape, error=None if values is None else values - low)

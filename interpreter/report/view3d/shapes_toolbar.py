"""Controls of the figure of deformed shapes: layout, colours, camera and time."""

from __future__ import annotations

import math
from collections.abc import Sequence

from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.report.charts.chart_axes import Axis, linear
from softmark.interpreter.report.charts.viridis import gradient
from softmark.interpreter.report.page.html_markup import tag, text
from softmark.records import dataclass

DECADES = 3  # decades of the logarithmic scale
MORE = " (the lightest colour includes all larger values)"
LESS = " (the darkest colour includes all smaller values)"
VIEWS = (
    (0, 2, "0 0"),
    (1, 2, "90 0"),
    (0, 1, "0 90"),
)  # places in the frame, to the right and upwards; turn and tilt


@dataclass(frozen=True)
class FigureKind:
    """Settings of one figure: suffix of its element names, whether errors are clipped initially, and its axes."""

    key: str
    clipped: bool
    axes: str  # letters of the level directions and of the upward one


def toolbar(
    names: Sequence[tuple[str, str, str, bool]],
    errors: bool,
    beside: bool,
    ghosts: Sequence[tuple[int, str, bool]],
    kind: FigureKind,
    carried: Sequence[str] = (),
) -> str:
    """Return the HTML of the controls, which are hidden without scripts.

    `names` has name, colour sample, CSS classes and initial visibility of each shape. `errors` is true if there are
    errors to show as colours, `beside` if shapes are initially side by side. `ghosts` has index, name and initial
    choice of each reference that can be drawn behind the shapes. `carried` are names of fields, such as stress, that
    colours can show.
    """
    key, first = kind.key, 0 if beside else 1
    groups = [_option_group("Layout", f"layout{key}", (("beside", "Side by side"), ("overlaid", "Overlaid")), first)]
    colours = ((("error", "Error"),) if errors else ()) + (("own", "By model"),)
    colours += (("carried", _kinds(carried)),) if carried else ()
    if len(colours) > 1:
        groups.append(_option_group("Colour", f"colour{key}", colours, first if errors else 1))
    if errors:
        scales = (("full", "Largest"), ("clipped", "Typical"), ("log", "Log"))
        groups.append(_option_group("Scale", f"range{key}", scales, 1 if kind.clipped else 0))
    groups.append(
        _option_group("Scale", f"span{key}", (("whole", "Largest"), ("usual", "Typical")), 1) if carried else ""
    )
    groups.append(_background_choice(ghosts) if ghosts else "")
    groups.append(_field_choice(carried) if len(carried) > 1 else "")
    groups.append(_view_buttons(kind.axes))
    who = tag("fieldset", tag("legend", "Shown"), *(_shape_checkbox(*known) for known in names), class_="who legend")
    return tag("div", *groups, who, class_="toolbar live")


def _option_group(legend: str, name: str, options: Sequence[tuple[str, str]], first: int) -> str:
    boxes = [
        tag(
            "label",
            tag("input", type="radio", name=name, value=value, checked=i == first),
            tag("span", words),
        )
        for i, (value, words) in enumerate(options)
    ]
    return tag("fieldset", tag("legend", legend), tag("div", *boxes, class_="segments"))


def _kinds(carried: Sequence[str]) -> str:
    """Return the names of the available kinds of fields as text, such as `Stress, strain`."""
    return ", ".join(dict.fromkeys(words.partition(" ")[0] for words in carried)).capitalize()


def _field_choice(carried: Sequence[str]) -> str:
    """Return the HTML of the choice of the field that is shown as colour."""
    options = [tag("option", text(words), value=f"n{i}") for i, words in enumerate(carried)]
    return tag("div", tag("label", tag("span", _kinds(carried)), tag("select", *options)), class_="behind number")


def _background_choice(ghosts: Sequence[tuple[int, str, bool]]) -> str:
    """Return the HTML of the choice of the reference that is drawn in grey behind each shape."""
    options = [tag("option", "nothing", value="")]
    options += [tag("option", text(name), value=str(i), selected=first) for i, name, first in ghosts]
    label = tag("label", tag("span", "Grey overlay"), tag("select", *options))
    return tag("div", label, class_="behind")


def _view_buttons(axes: str) -> str:
    zooms = (("out", "−", "Zoom out"), ("in", "+", "Zoom in"), ("home", "Reset", None))
    planes = [(f"{axes[a]}–{axes[b]}", angles) for a, b, angles in VIEWS]
    buttons = [
        tag("button", name, type="button", data_view=angles, aria_label=f"View of {name}") for name, angles in planes
    ]
    buttons += [tag("button", sign, type="button", data_zoom=act, aria_label=words) for act, sign, words in zooms]
    return tag("fieldset", tag("legend", "View"), tag("div", *buttons, class_="segments"))


def _shape_checkbox(name: str, drawn: str, classes: str, shown: bool) -> str:
    box = tag("input", type="checkbox", value=name, checked=shown)
    return tag("label", box, drawn, tag("span", text(name)), class_=classes.split()[0])


def time_bar(name: str) -> str:
    """Return the HTML of the slider of times or states, with its play button."""
    play = tag("button", "Play", type="button", class_="play")
    slider = tag("input", type="range", min=0, max=1000, value=1000, step=1)
    label = tag("label", tag("span", text(name)), slider)
    return tag("div", play, label, tag("output", "end"), class_="time live")


def colour_bar(most: float, clipped: float, name: str) -> str:
    """Return the HTML of the colour bar of errors with three scales.

    They go up to the largest error `most`, m, up to the end of the typical range `clipped`, m, and over DECADES
    decades. The style sheet shows the scale that the reader chose.
    """
    top, cut = most or 1e-9, clipped or most or 1e-9
    scales = scale_below(linear(0.0, top, name, "m", 6), "full", "")
    scales += scale_below(linear(0.0, cut, name, "m", 6), "clipped", MORE)
    low = top * 10.0**-DECADES
    whole = range(math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(top) + 1e-9) + 1)
    decades = tuple((10.0**k, format_quantity(10.0**k, "m", 3)) for k in whole)
    scales += scale_below(Axis(low, top, f"{name}, logarithmic", decades, log=True), "log", LESS)
    return tag("div", colour_strip(), scales, class_="colour-bar")


def colour_strip() -> str:
    """Return the HTML of the strip of colours of a colour bar, from the smallest to the largest value."""
    return tag("div", class_="colours", style=f"background:{gradient()}", aria_hidden="true")


def scale_below(axis: Axis, kind: str, ends: str) -> str:
    """Return the HTML below a colour bar: the ticks of its axis, and the axis label followed by the text `ends`.

    `kind` is a CSS class by which the style sheet shows the scale, such as `log`.
    """
    ticks = [tag("span", text(label), style=f"left:{100 * axis.at(value):.2f}%") for value, label in axis.ticks]
    marks = tag("div", *ticks, class_="marks")
    return tag("div", marks, tag("p", text(axis.label + ends)), class_=f"scale {kind}".strip())

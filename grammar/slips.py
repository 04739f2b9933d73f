"""What to say about a text that the parser does not take: from the token that does not fit to human words.

To recognise one more mistake: one function from `Slip` to `Diagnostic | None` and its name in `CHECKS`; the first that
answers is heard. `CODES` lists what each code means; a code keeps its meaning for ever.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.lalr import END, accepted
from softmark.grammar.lex import BREAK, Token
from softmark.grammar.split import CLOSERS, MAX_NESTING, OPENERS, WORDS, Chunk
from softmark.grammar.table import load, reserved
from softmark.grammar.tree import Argument, Expression, Number, Span, Unit

SHAPE = "a declaration reads `kind name = value`"
WORDS_FOR = {  # kinds of token that have no fixed text
    "NUMBER": "a value",
    "NAME": "a name",
    "STRING": "a text in double quotes",
    "COMPARE": "a comparison",
    "RANGE": "`..`",
    END: "the end of the line",
}
LOOKALIKES = {
    "−": "-", "–": "-", "—": "-", "×": "*", "·": "*", "⋅": "*", "∙": "*", "÷": "/", "≤": "<=", "≥": ">=",
    "≠": "!=", "…": "..", "...": "..", "“": '"', "”": '"', "„": '"', "«": '"', "»": '"', "‘": '"', "’": '"', "&": "and",
    "&&": "and", "|": "or", "||": "or", "!": "not", "（": "(", "）": ")", "，": ",", "＝": "=",
}  # fmt: skip
FOREIGN_WORDS = {"import": "use", "include": "use", "from": "use", "let": "param", "const": "param", "var": "param",
                 "assert": "expect", "require": "expect"}  # fmt: skip


@dataclass(frozen=True)
class Slip:
    """The declaration `tokens`, whose `tokens[index]` does not fit."""

    source: Source
    chunk: Chunk
    tokens: Sequence[Token]
    index: int
    start: str
    second: int | None = None  # where another declaration starts on the same line

    @property
    def found(self) -> Token:
        """The token that does not fit."""
        return self.tokens[self.index]

    def kind(self, offset: int) -> str:
        """The kind of the token `offset` places from the one that does not fit; empty beyond the ends."""
        place = self.index + offset
        return self.tokens[place].kind if 0 <= place < len(self.tokens) else ""

    def text(self, offset: int) -> str:
        """The text of the token `offset` places from the one that does not fit."""
        place = self.index + offset
        return self.tokens[place].text if 0 <= place < len(self.tokens) else ""

    @cached_property
    def accepts(self) -> frozenset[str]:
        """The kinds of token that would have fitted."""
        return accepted(load(), self.tokens[: self.index], self.start)

    @cached_property
    def brackets(self) -> tuple[int, ...]:
        """The places of the brackets that are open here, outermost first."""
        stack: list[int] = []
        for place, token in enumerate(self.tokens[: self.index]):
            if token.kind in OPENERS:
                stack.append(place)
            elif token.kind in CLOSERS and stack:
                stack.pop()
        return tuple(stack)

    @property
    def in_call(self) -> bool:
        """Whether the innermost open bracket holds arguments."""
        place = self.brackets[-1] if self.brackets else 0
        return self.tokens[place].kind == "LPAR" and self.tokens[place - 1].kind in ("NAME", "PATH")

    @property
    def expected(self) -> str:
        """`expected a value after `=``: what would have fitted, and after what."""
        after = f" after {_show(self.tokens[self.index - 1])}" if self.index else ""
        return f"expected {self._wanted()}{after}"

    def _wanted(self) -> str:
        if "NUMBER" in self.accepts:
            return "a value" if "NOT" in self.accepts or self.start == "expression" else "a number"
        if not self.index:
            return "a declaration"
        closing = ["COMMA", "RPAR", "RSQB", "EQUAL", "AS", "RANGE", "STRING", "NAME", END]
        wanted = [self._word(kind) for kind in closing if kind in self.accepts]
        if not self.brackets and "EQUAL" not in self.accepts and "COMPARE" in self.accepts:
            wanted.insert(0, "an operator")
        return f"{', '.join(wanted[:-1])} or {wanted[-1]}" if len(wanted) > 1 else "".join(wanted)

    def _word(self, kind: str) -> str:
        if kind == END and self.start == "expression":
            return "the end"
        literal = next((t.literal for t in load().terminals if t.name == kind), "")
        return f"`{literal}`" if literal else WORDS_FOR[kind]

    def say(self, code: str, message: str = "", help: str = "", label: str = "", at: Token | None = None) -> Diagnostic:
        """A diagnostic at the token that does not fit; without a message, what was expected and found."""
        message = message or f"{self.expected}, found {self.shown}"
        return Diagnostic(code, message, self.source, (at or self.found).span, label, help)

    @property
    def shown(self) -> str:
        """The token that does not fit, in words."""
        if self.found.kind == END:
            return self._word(END)
        return _show(self.found)


def _show(token: Token) -> str:
    text = re.split(BREAK, token.text, maxsplit=1)[0]
    text = text if len(text) <= 30 else f"{text[:27]}..."
    names = {"UNIT": "the unit ", "NUMBER": "the number ", "STRING": "the text "}
    return f"{names.get(token.kind, '')}`{text}`"


def explain(slip: Slip) -> Diagnostic:
    """What is wrong at the token that does not fit."""
    return next(found for check in CHECKS if (found := check(slip)))


# ------------------------------------------------------------------- what the parser finds


def _second(slip: Slip) -> Diagnostic | None:
    if slip.second is None:
        return None
    at = slip.tokens[slip.second]
    return slip.say("E115", "a second declaration on one line", f"start a new line before `{at.text}`", at=at)


def _junk(slip: Slip) -> Diagnostic | None:
    text = slip.found.text
    match slip.found.kind:
        case "UNCLOSED_STRING":
            return slip.say("E103", "the text is not closed", 'a text ends on the line it starts on, with `"`')
        case "SEMICOLON":
            return slip.say("E107", "a declaration ends with its line, without `;`", "remove the `;`")
        case "SLASHES" | "BLOCK_COMMENT":
            return slip.say("E108", f"a comment starts with `#`, not with `{text[:2]}`", "write `# ...`")
        case "SINGLE_QUOTED":
            return slip.say("E109", "a text stands in double quotes", f'write `"{text.strip(chr(39))}"`')
        case "LBRACE" | "RBRACE":
            return slip.say("E112", f"there are no blocks in `{{ }}`, found `{text}`", _no_block(slip))
        case "FOREIGN_WORD":
            help = "names are made of the letters A to Z, a to z, digits and `_`"
            return slip.say("E130", f"`{text[:30]}` is not a name", help)
        case "ILLEGAL":
            instead = LOOKALIKES.get(text, "")
            return slip.say("E102", f"unexpected {_character(text)}", f"write `{instead}`" if instead else "")
    return None


def _no_block(slip: Slip) -> str:
    return "fields go into a call: `material skin = neo_hookean(young = 60 kPa, poisson = 0.49)`"


def _character(text: str) -> str:
    if text.isprintable():
        return f"`{text[:30]}`"
    return f"character U+{ord(text[0]):04X}"


def _foreign_word(slip: Slip) -> Diagnostic | None:
    first = slip.tokens[0]
    instead = FOREIGN_WORDS.get(first.text)
    if slip.start != "declaration" or not slip.index or not instead or slip.kind(0) == "EQUAL":
        return None
    return foreign_kind(slip.source, first, instead)


def _unclosed(slip: Slip) -> Diagnostic | None:
    if not slip.brackets or not slip.chunk.unclosed:
        return None
    starts_line = slip.found.line != slip.tokens[slip.index - 1].line
    if slip.found.kind != END and not starts_line:
        return None
    opening = slip.tokens[slip.brackets[-1]]
    closing = {"LPAR": ")", "LSQB": "]"}.get(opening.kind, "}")
    return slip.say("E104", f"`{opening.text}` is not closed", f"add the `{closing}`", at=opening)


def _wrong_closing(slip: Slip) -> Diagnostic | None:
    found = slip.found
    if found.kind not in CLOSERS:
        return None
    if not slip.brackets:
        return slip.say("E105", f"`{found.text}` closes nothing", f"remove the `{found.text}`, or open it before")
    opening = slip.tokens[slip.brackets[-1]]
    if OPENERS[opening.kind] == found.kind:
        return None
    message = f"`{opening.text}` of line {opening.line} is closed by `{found.text}`"
    return slip.say("E104", message, "close the brackets in the order they were opened, each by its own kind")


def _brackets_without_items(slip: Slip) -> Diagnostic | None:
    if slip.found.kind != "RPAR" or slip.in_call:
        return None
    if slip.kind(-1) == "COMMA":
        return slip.say("E126", "a vector has at least two items", "a list may have one: `[1] mm`")
    if slip.kind(-1) == "LPAR":
        return slip.say("E126", "the brackets are empty", "a list may be empty: `[]`")
    return None


def _comma(slip: Slip) -> Diagnostic | None:
    if slip.found.kind != "COMMA" or "NUMBER" in slip.accepts:
        return None
    if slip.kind(-1) == slip.kind(1) == "NUMBER" and slip.found.end == slip.tokens[slip.index + 1].start:
        return slip.say("E113", "the decimal sign is a point", f"write `{slip.text(-1)}.{slip.text(1)}`")
    if slip.brackets or END not in slip.accepts:
        return None
    at_end = slip.kind(1) == END
    message = "a declaration ends without a comma" if at_end else "there is no comma outside brackets"
    return slip.say("E111", message, "remove the `,`" if at_end else "write one declaration for each")


def _equal(slip: Slip) -> Diagnostic | None:
    """Something else where `=` is due."""
    if "EQUAL" not in slip.accepts or not (_names_declaration(slip) or _names_argument(slip)):
        return None
    name, text = slip.text(-1), slip.text(0)
    if slip.found.kind in ("COLON", "COMPARE") and text in (":", ":=", "=="):
        return slip.say("E106", f"expected `=` after `{name}`, found `{text}`", f"write `{name} = ...`")
    if _names_declaration(slip) and slip.found.kind != "LBRACE":
        return slip.say("E106", "", f"write `{slip.text(-2)} {name} = ...`")
    if slip.found.kind in ("NUMBER", "STRING", "LSQB"):
        return slip.say("E106", f"expected `=` after `{name}`, found {slip.shown}", f"write `{name} = {text} ...`")
    return None


def _names_declaration(slip: Slip) -> bool:
    return slip.start == "declaration" and slip.index == 2


def _names_argument(slip: Slip) -> bool:
    return slip.in_call and slip.kind(-1) == "NAME" and slip.kind(-2) in ("LPAR", "COMMA")


def _comparison(slip: Slip) -> Diagnostic | None:
    """`=` where an expression has ended, or `=<`."""
    if slip.found.kind == "COMPARE" and slip.kind(-1) == "EQUAL" and slip.tokens[slip.index - 1].end == slip.found.start:
        return slip.say("E101", f"there is no operator `={slip.text(0)}`", f"write `{slip.text(0)}=`")
    if slip.found.kind != "EQUAL":
        return None
    after = slip.text(1) if slip.kind(1) == "COMPARE" else ""
    if slip.kind(-1) == "COMPARE":
        return slip.say("E101", f"there is no operator `{slip.text(-1)}=`", f"write `{slip.text(-1)}`")
    if "COMPARE" not in slip.accepts or slip.kind(-1) == "UNIT" and slip.in_call:
        return None
    if after:
        return slip.say("E101", f"there is no operator `={after}`", f"write `{after}=`")
    if slip.tokens[0].kind in ("EXPECT", "PARAM") or slip.index > 3 and not slip.brackets:
        return slip.say("E117", "`=` gives a name its value; to compare, write `==`", "write `==`")
    if slip.brackets and not slip.in_call:
        help = "a name with a value belongs into a call: `cylinder(length = 3 mm)`"
        return slip.say("E101", "", help)
    return None


def _reserved(slip: Slip) -> Diagnostic | None:
    found = slip.found
    if found.text not in reserved() or "NAME" not in slip.accepts or not slip.index:
        return None
    if "NUMBER" in slip.accepts and found.kind not in WORDS and slip.kind(1) != "EQUAL":
        return None
    help = f"choose another name; reserved are {', '.join(f'`{word}`' for word in reserved())}"
    return slip.say("E114", f"`{found.text}` is a reserved word", help)


def _missing_comma(slip: Slip) -> Diagnostic | None:
    if "COMMA" not in slip.accepts and not (slip.found.kind == "EQUAL" and slip.kind(-1) == "UNIT" and slip.in_call):
        return None
    at = slip.found
    if at.kind == "EQUAL" and slip.kind(-1) == "UNIT":
        at = slip.tokens[slip.index - 1]  # `f(x = 3 y = 4)`: `y` was taken for a unit
    elif at.kind == "UNIT" and slip.kind(1) != "EQUAL":
        return None
    elif at.kind not in ("NAME", "PATH", "NUMBER", "STRING", "LPAR", "LSQB", "UNIT"):
        return None
    before = slip.tokens[slip.tokens.index(at) - 1]
    return slip.say("E110", f"expected `,` between {_show(before)} and `{at.text}`", at=at)


def _unit(slip: Slip) -> Diagnostic | None:
    if slip.found.kind != "UNIT":
        return None
    help = f"multiply: `* 1 {slip.text(0)}`"
    return slip.say("E118", "a unit follows a number, a vector or a list; here it follows a call or a group", help)


def _shape(slip: Slip) -> Diagnostic | None:
    """The first words of a declaration."""
    if slip.start != "declaration" or slip.index > 1:
        return None
    if slip.index == 0:
        help = f"{SHAPE}; one goes on over the end of a line inside brackets, or after an operator"
        return slip.say("E128", f"a declaration cannot start with {slip.shown}", help)
    if slip.tokens[0].kind != "NAME" or slip.kind(0) != "EQUAL":
        help = f"{SHAPE}" if slip.tokens[0].kind == "NAME" else ""
        return slip.say("E128" if "NAME" in slip.accepts else "E101", "", help)
    return slip.say("E128", "", f"{SHAPE}; for a number, `param {slip.text(-1)} = ...`")


def _value(slip: Slip) -> Diagnostic | None:
    if "NUMBER" not in slip.accepts:
        return None
    help = ""
    if slip.found.kind == "TIMES" and slip.kind(-1) == "TIMES":
        help = "a power is written `^`" if slip.text(0) == "*" else ""
    return slip.say("E129", "", help)


def _anything_else(slip: Slip) -> Diagnostic:
    return slip.say("E101")


Check = Callable[[Slip], Diagnostic | None]
CHECKS: tuple[Check, ...] = (
    _second,
    _foreign_word,
    _equal,
    _junk,
    _unclosed,
    _wrong_closing,
    _brackets_without_items,
    _comma,
    _comparison,
    _reserved,
    _missing_comma,
    _unit,
    _shape,
    _value,
    _anything_else,
)


# ------------------------------------------------------- several declarations on one line


def second_declaration(tokens: Sequence[Token], index: int) -> int | None:
    """Where a second declaration starts on the line of `tokens[index]`, which does not fit; None if none does."""
    for start in (index, index - 1):
        if start > 1 and _opens(tokens[start : start + 3]) and END in accepted(load(), tokens[:start], "declaration"):
            return start
    return None


def _opens(tokens: Sequence[Token]) -> bool:
    first, *rest = tokens
    is_name = re.fullmatch(r"[A-Za-z_]\w*", first.text, re.ASCII) and first.kind in ("NAME", "UNIT")
    return first.kind in WORDS or bool(is_name) and [token.kind for token in rest] == ["NAME", "EQUAL"]


def declared(tokens: Sequence[Token]) -> list[str]:
    """The name that a declaration in error meant to declare, if it got so far."""
    kinds = [token.kind for token in tokens[:4]]
    if kinds[:2] in (["PARAM", "NAME"], ["NAME", "NAME"]):
        return [tokens[1].text]
    return [tokens[3].text] if kinds == ["USE", "STRING", "AS", "NAME"] else []

"""Explanations of syntax errors: messages for common mistakes, chosen by the token that the parser cannot accept.

To recognise one more mistake: write a function from `Slip` to `Diagnostic | None`, and add its name to `CHECKS`. The
first check that returns a diagnostic is used. `diagnostic_codes.py` defines each code.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import pairwise

from softmark.grammar import input_limits
from softmark.grammar.diagnostic import Diagnostic, Fix, Remedy, Source, as_remedy, suggest_text
from softmark.grammar.lalr_driver import END, acceptable_kinds
from softmark.grammar.lexer import BREAK, Token
from softmark.grammar.parse_table import load, reserved_words
from softmark.grammar.statement_splitting import CLOSERS, OPENERS, WORDS, Chunk
from softmark.grammar.tree import Span, span_between
from softmark.records import dataclass

VALUES = frozenset({"NAME", "PATH", "NUMBER", "STRING", "LPAR", "LSQB", "UNIT"})  # tokens that start a value
FAR = 400  # characters examined behind a comment
SHAPE = "write a declaration as `kind name = value`"
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
    "≠": "!=", "…": "..", "...": "..", "“": '"', "”": '"', "„": '"', "«": '"', "»": '"', "‘": '"', "’": '"',
    "&": "and", "&&": "and", "|": "or", "||": "or", "!": "not", "（": "(", "）": ")", "，": ",", "＝": "=",
}  # fmt: skip
FOREIGN_WORDS = {"import": "use", "include": "use", "from": "use", "let": "param", "const": "param",
                 "var": "param", "assert": "expect", "require": "expect"}  # fmt: skip

PROGRAMS = frozenset({"for", "if", "while", "def"})  # keywords of programming languages


@dataclass(frozen=True)
class Slip:
    """Syntax error in the `tokens` of a declaration, at the unexpected token `tokens[index]`."""

    source: Source
    chunk: Chunk
    tokens: Sequence[Token]
    index: int
    start: str
    second: int | None = None  # start of another declaration on the same line

    @property
    def unexpected_token(self) -> Token:
        """Unexpected token."""
        return self.tokens[self.index]

    def kind(self, offset: int) -> str:
        """Return the kind of the token `offset` positions after the unexpected one; empty beyond the ends."""
        place = self.index + offset
        return self.tokens[place].kind if 0 <= place < len(self.tokens) else ""

    def text(self, offset: int) -> str:
        """Return the text of the token `offset` positions after the unexpected one."""
        place = self.index + offset
        return self.tokens[place].text if 0 <= place < len(self.tokens) else ""

    @cached_property
    def accepted_kinds(self) -> frozenset[str]:
        """Kinds of token that the parser would have accepted."""
        return acceptable_kinds(load(), self.tokens[: self.index], self.start)

    @cached_property
    def brackets(self) -> tuple[int, ...]:
        """Indices of the brackets that are open at the unexpected token, the outermost first."""
        stack: list[int] = []
        for place, token in enumerate(self.tokens[: self.index]):
            if token.kind in OPENERS:
                stack.append(place)
            elif token.kind in CLOSERS and stack:
                stack.pop()
        return tuple(stack)

    @property
    def in_call(self) -> bool:
        """True if the innermost open bracket contains the arguments of a call."""
        place = self.brackets[-1] if self.brackets else 0
        return self.tokens[place].kind == "LPAR" and self.tokens[place - 1].kind in ("NAME", "PATH")

    @property
    def expected(self) -> str:
        """Text such as `expected a value after `=``, which names the accepted tokens and the preceding one."""
        after = f" after {_show(self.tokens[self.index - 1])}" if self.index else ""
        return f"expected {self._describe_accepted_tokens()}{after}"

    def _describe_accepted_tokens(self) -> str:
        if "NUMBER" in self.accepted_kinds:
            return "a version number" if self.accepted_kinds == {"NUMBER"} else "a value"
        kinds = ["COMMA", "RPAR", "RSQB", "EQUAL", "AS", "RANGE", "STRING", "NAME", END]
        wanted = [self._describe_kind(kind) for kind in kinds if kind in self.accepted_kinds]
        if END in self.accepted_kinds:
            wanted.insert(0, "an operator")
        return f"{', '.join(wanted[:-1])} or {wanted[-1]}" if len(wanted) > 1 else wanted[0]

    def _describe_kind(self, kind: str) -> str:
        if kind == END and self.start == "expression":
            return "the end"
        literal = next((t.literal for t in load().terminals if t.name == kind), "")
        return f"`{literal}`" if literal else WORDS_FOR[kind]

    def make_diagnostic(
        self, code: str, message: str = "", help: str | Remedy = "", label: str = "", at: Token | None = None
    ) -> Diagnostic:
        """Return a diagnostic at the unexpected token, or at the token `at`.

        By default its message names the expected tokens and the token found.
        """
        message, remedy = message or f"{self.expected}, found {self.shown}", as_remedy(help)
        return Diagnostic(
            code, message, self.source, (at or self.unexpected_token).span, label, remedy.help, fix=remedy.fix
        )

    def before(self, text: str, offset: int = 0) -> Fix:
        """Return a fix that inserts text before the token `offset` positions after the unexpected one."""
        token = self.tokens[self.index + offset]
        return Fix(text, Span(token.start, token.start, token.line, token.column, token.line, token.column))

    def after(self, text: str, place: int) -> Fix:
        """Return a fix that inserts text behind the token with index `place`."""
        end = self.tokens[place].span
        return Fix(text, Span(end.end, end.end, end.end_line, end.end_column, end.end_line, end.end_column))

    def over(self, text: str, first: int, last: int) -> Fix:
        """Return a fix that replaces tokens `first` to `last`, counted from the unexpected one."""
        return Fix(text, span_between(self.tokens[self.index + first].span, self.tokens[self.index + last].span))

    @property
    def shown(self) -> str:
        """Description of the unexpected token for messages."""
        if self.unexpected_token.kind == END:
            return self._describe_kind(END)
        return _show(self.unexpected_token)


def _show(token: Token) -> str:
    text = re.split(BREAK, token.text, maxsplit=1)[0]
    text = text if len(text) <= 30 else f"{text[:27]}..."
    names = {"UNIT": "the unit ", "NUMBER": "the number ", "STRING": "the text "}
    return f"{names.get(token.kind, '')}`{text}`"


def explain(slip: Slip) -> Diagnostic:
    """Return the diagnostic for the unexpected token."""
    return next(found for check in CHECKS if (found := check(slip)))


# ------------------------------------------------------------------- what the parser finds


def _report_second_declaration(slip: Slip) -> Diagnostic | None:
    if slip.second is None:
        return None
    at = slip.tokens[slip.second]
    remedy = Remedy(f"start a new line before `{at.text}`", slip.before("\n", slip.second - slip.index))
    return slip.make_diagnostic("E115", "a second declaration on one line", remedy, at=at)


def _report_junk(slip: Slip) -> Diagnostic | None:
    text = slip.unexpected_token.text
    match slip.unexpected_token.kind:
        case "UNCLOSED_STRING":
            return slip.make_diagnostic(
                "E103", "the text is not closed", 'close the text with `"` on the line on which it starts'
            )
        case "SEMICOLON":
            return slip.make_diagnostic(
                "E107", "a declaration ends at the end of its line, without `;`", Remedy("remove the `;`", Fix(""))
            )
        case "SLASHES" | "BLOCK_COMMENT":
            remedy = Remedy("write `# ...`", _comment_fix(slip))
            return slip.make_diagnostic("E108", f"a comment starts with `#`, not with `{text[:2]}`", remedy)
        case "SINGLE_QUOTED":
            return slip.make_diagnostic(
                "E109", "a text must be in double quotes", suggest_text(f'"{text.strip(chr(39))}"')
            )
        case "LBRACE" | "RBRACE":
            help = "write fields in a call: `material skin = neo_hookean(young = 60 kPa, poisson = 0.49)`"
            return slip.make_diagnostic("E112", f"blocks in braces do not exist, found `{text}`", help)
        case "FOREIGN_WORD":
            help = "use the letters A to Z, a to z, digits and `_` in names"
            return slip.make_diagnostic("E130", f"`{text[:30]}` is not a name", help)
        case "ILLEGAL":
            return slip.make_diagnostic("E102", f"unexpected {_describe_character(text)}", _replace_lookalike(slip))
    return None


def _comment_fix(slip: Slip) -> Fix | None:
    """Return the fix that rewrites a comment of another language at the end of its line, or None."""
    text, end = slip.unexpected_token.text, slip.unexpected_token.end
    if re.search(BREAK, text) or not re.match(rf"[ \t]*(?:{BREAK}|\Z)", slip.source.text[end : end + FAR]):
        return None
    return Fix(f"# {text[2:].removesuffix('*/').strip()}")


def _replace_lookalike(slip: Slip) -> str | Remedy:
    """Return the replacement of a look-alike character; for quotes, the other quote is replaced as well."""
    found = slip.unexpected_token
    instead = LOOKALIKES.get(found.text, "")
    if instead != '"':
        return suggest_text(instead) if instead else ""
    quotes = "".join(one for one, plain in LOOKALIKES.items() if plain == '"')
    quoted = re.compile(rf'[{quotes}]([^{quotes}"\\\r\n]*)[{quotes}"]').match(slip.source.text, found.start)
    if quoted is None:
        return suggest_text(instead)
    at, length = found.span, len(quoted[0])
    whole = Span(at.start, at.start + length, at.line, at.column, at.line, at.column + length)
    return Remedy(f"write `{instead}`", Fix(f'"{quoted[1]}"', whole))


def _describe_character(text: str) -> str:
    if text.isprintable():
        return f"`{text[:30]}`"
    return f"character U+{ord(text[0]):04X}"


def _report_foreign_word(slip: Slip) -> Diagnostic | None:
    first = slip.tokens[0]
    instead = FOREIGN_WORDS.get(first.text)
    if slip.start != "declaration" or slip.index not in (1, 2) or not instead or slip.kind(0) == "EQUAL":
        return None
    return input_limits.foreign_word(slip.source, first, instead)


def _report_unclosed_bracket(slip: Slip) -> Diagnostic | None:
    if not slip.brackets or not slip.chunk.unclosed:
        return None
    starts_line = slip.unexpected_token.line != slip.tokens[slip.index - 1].line
    if slip.unexpected_token.kind != END and not starts_line:
        return None
    opening = slip.tokens[slip.brackets[-1]]
    closings = {"LPAR": ")", "LSQB": "]"}
    missing = "".join(closings.get(slip.tokens[place].kind, "}") for place in reversed(slip.brackets))
    remedy = Remedy(f"add the `{closings.get(opening.kind, '}')}`", slip.after(missing, slip.index - 1))
    return slip.make_diagnostic("E104", f"`{opening.text}` is not closed", remedy, "opened here", opening)


def _report_wrong_closing_bracket(slip: Slip) -> Diagnostic | None:
    found = slip.unexpected_token
    if found.kind not in CLOSERS:
        return None
    if not slip.brackets:
        remedy = Remedy(f"remove the `{found.text}`, or add its opening bracket", Fix(""))
        return slip.make_diagnostic("E105", f"`{found.text}` has no opening bracket", remedy)
    opening = slip.tokens[slip.brackets[-1]]
    if OPENERS[opening.kind] == found.kind:
        return None
    message = f"`{opening.text}` of line {opening.line} is closed by `{found.text}`"
    return slip.make_diagnostic(
        "E104", message, "close the brackets in the order in which they were opened, each with its own kind"
    )


def _report_too_few_items(slip: Slip) -> Diagnostic | None:
    if slip.unexpected_token.kind != "RPAR" or slip.in_call:
        return None
    if slip.kind(-1) == "COMMA":
        return slip.make_diagnostic(
            "E126", "a vector needs at least two items", "write a list, which may have one item: `[1] mm`"
        )
    if slip.kind(-1) == "LPAR":
        return slip.make_diagnostic("E126", "the brackets are empty", "write items, or an empty list: `[]`")
    return None


def _report_misplaced_comma(slip: Slip) -> Diagnostic | None:
    if slip.unexpected_token.kind != "COMMA" or "NUMBER" in slip.accepted_kinds:
        return None
    if slip.kind(-1) == slip.kind(1) == "NUMBER" and slip.unexpected_token.end == slip.tokens[slip.index + 1].start:
        number = f"{slip.text(-1)}.{slip.text(1)}"
        return slip.make_diagnostic(
            "E113", "the decimal sign is a point", Remedy(f"write `{number}`", slip.over(number, -1, 1))
        )
    if slip.brackets or END not in slip.accepted_kinds:
        return None
    at_end = slip.kind(1) == END
    message = "a declaration ends without a comma" if at_end else "a comma is allowed only inside brackets"
    remedy = Remedy("remove the `,`", Fix("")) if at_end else "write one declaration for each"
    return slip.make_diagnostic("E111", message, remedy)


def _report_missing_equals(slip: Slip) -> Diagnostic | None:
    """Report a token in the place of a required `=`."""
    if "EQUAL" not in slip.accepted_kinds or not (_names_declaration(slip) or _names_argument(slip)):
        return None
    name, text = slip.text(-1), slip.text(0)
    message = f"expected `=` after `{name}`, found {slip.shown}"
    if _names_declaration(slip) and slip.text(-2) in PROGRAMS:
        return slip.make_diagnostic(
            "E106",
            message,
            "a scene has declarations, not statements; to vary a value, write `study NAME = sweep(...)`",
        )
    if text in (":", ":=", "=="):
        return slip.make_diagnostic("E106", message, Remedy(f"write `{name} = ...`", Fix("=")))
    if _names_declaration(slip) and slip.unexpected_token.kind != "LBRACE":
        return slip.make_diagnostic("E106", message, Remedy(f"write `{slip.text(-2)} {name} = ...`", slip.before("= ")))
    if slip.unexpected_token.kind in ("NUMBER", "STRING", "LSQB"):
        shown = f"{name} = {text}{' ...' if slip.unexpected_token.kind == 'LSQB' else ''}"
        return slip.make_diagnostic("E106", message, Remedy(f"write `{shown}`", slip.before("= ")))
    return None


def _names_declaration(slip: Slip) -> bool:
    return slip.start == "declaration" and slip.index == 2


def _names_argument(slip: Slip) -> bool:
    return slip.in_call and slip.kind(-1) == "NAME" and slip.kind(-2) in ("LPAR", "COMMA")


def _report_foreign_operator(slip: Slip) -> Diagnostic | None:
    """Report operators of other languages such as `=<`, `=>`, `<==`, `**`, `<>`."""
    instead = {"=<": "<=", "=>": ">=", "**": "^", "<>": "!=", "===": "==", "!==": "!="}
    for pair in ((slip.index - 1, slip.index), (slip.index, slip.index + 1)):
        if pair[0] >= 0 and pair[1] < len(slip.tokens):
            first, second = (slip.tokens[place] for place in pair)
            text = first.text + second.text
            if text in instead and first.end == second.start:
                remedy = Remedy(f"write `{instead[text]}`", Fix(instead[text], span_between(first.span, second.span)))
                return slip.make_diagnostic("E101", f"there is no operator `{text}`", remedy, at=first)
    return None


def _report_single_equals(slip: Slip) -> Diagnostic | None:
    """Report a single `=` after a complete expression."""
    if slip.unexpected_token.kind != "EQUAL" or "COMPARE" not in slip.accepted_kinds:
        return None
    if slip.in_call:
        return _report_equals_in_argument(slip)
    if slip.kind(-1) == "NAME" and slip.kind(-2) in ("LPAR", "COMMA") and slip.tokens[0].kind != "EXPECT":
        return slip.make_diagnostic("E101", help="write named values in a call: `cylinder(length = 3 mm)`")
    return slip.make_diagnostic("E117", "`=` assigns a value; to compare, write `==`", suggest_text("=="))


def _report_equals_in_argument(slip: Slip) -> Diagnostic | None:
    """Report `=` in place of `==` in an argument such as `where = x = 0 mm`.

    After a comma, `=` more likely names an argument.
    """
    start = slip.brackets[-1] + 1
    commas = [place for place in range(start, slip.index) if slip.tokens[place].kind == "COMMA"]
    own = [token.kind for token in slip.tokens[(commas[-1] + 1 if commas else start) : slip.index]]
    if own[:2] != ["NAME", "EQUAL"] or slip.kind(-1) != "NAME" or slip.kind(-2) in VALUES | CLOSERS:
        return None  # `f(a = 1 b = 2)`: a comma is missing
    remedy = suggest_text("==", ", or `<=` or `>=` to select a region")
    return slip.make_diagnostic("E117", "`=` assigns a value; to compare, write `==`", remedy)


def _report_reserved_word(slip: Slip) -> Diagnostic | None:
    found = slip.unexpected_token
    if found.text not in reserved_words() or "NAME" not in slip.accepted_kinds or not slip.index:
        return None
    if "NUMBER" in slip.accepted_kinds and found.kind not in WORDS and slip.kind(1) != "EQUAL":
        return None
    help = f"choose another name; reserved are {', '.join(f'`{word}`' for word in sorted(reserved_words()))}"
    return slip.make_diagnostic("E114", f"`{found.text}` is a reserved word", help)


def _report_unjoined_unit(slip: Slip) -> Diagnostic | None:
    """Report a unit whose factors are not joined by `*`, such as `1000 kg m^-3`."""
    before, found = slip.kind(-1), slip.unexpected_token
    if before != "UNIT" or found.kind != "NAME" or found.line != slip.tokens[slip.index - 1].line:
        return None
    rest = [found.text]
    for first, second in pairwise(slip.tokens[slip.index : slip.index + 5]):
        if second.kind not in ("CIRCUMFLEX", "SIGN", "NUMBER") or first.end != second.start:
            break
        rest.append(second.text)
    if slip.kind(1) in ("EQUAL", "LPAR") or found.text in reserved_words() or (slip.brackets and len(rest) == 1):
        return None
    unit, last = f"{slip.text(-1)}*{''.join(rest)}", len(rest) - 1
    return slip.make_diagnostic("E101", help=Remedy(f"join units with `*`: `{unit}`", slip.over(unit, -1, last)))


def _report_missing_comma(slip: Slip) -> Diagnostic | None:
    place = slip.index
    if slip.in_call and slip.unexpected_token.kind == "EQUAL" and slip.kind(-1) == "UNIT":
        place -= 1  # `f(x = 3 y = 4)`: `y` was taken for a unit
    elif "COMMA" not in slip.accepted_kinds or slip.unexpected_token.kind not in VALUES or _is_unit(slip):
        return None
    at = slip.tokens[place]
    message = f"expected `,` between {_show(slip.tokens[place - 1])} and `{at.text}`"
    remedy = Remedy("", slip.after(",", place - 1))
    return slip.make_diagnostic("E110", message, remedy, "`,` is missing before this", at)


def _is_unit(slip: Slip) -> bool:
    return slip.unexpected_token.kind == "UNIT" and slip.kind(1) != "EQUAL"


def _report_misplaced_unit(slip: Slip) -> Diagnostic | None:
    if slip.unexpected_token.kind != "UNIT":
        return None
    factor = f"* 1 {slip.text(0)}"
    message = "a unit must follow a number, a vector or a list; here it follows a call or a group"
    return slip.make_diagnostic("E118", message, Remedy(f"multiply: `{factor}`", Fix(factor)))


def _report_declaration_start(slip: Slip) -> Diagnostic | None:
    """Report errors in the first words of a declaration."""
    if slip.start != "declaration" or slip.index > 1:
        return None
    if slip.index == 0:
        help = f"{SHAPE}; it continues on the next line only inside brackets or after an operator"
        return slip.make_diagnostic("E128", f"a declaration cannot start with {slip.shown}", help)
    if slip.accepted_kinds != {"NAME"}:
        return None
    if slip.kind(0) == "PATH":
        return slip.make_diagnostic("E128", help="a declared name must not contain dots")
    if slip.kind(-1) == "PARAM":
        return slip.make_diagnostic("E128", help="write a parameter as `param name = value`")
    if slip.kind(0) == "LPAR":
        return slip.make_diagnostic("E128", help=f"give it a kind and a name: `kind name = {slip.text(-1)}(...)`")
    return slip.make_diagnostic("E128", help=f"{SHAPE}; for a quantity, `param {slip.text(-1)} = ...`")


def _report_missing_value(slip: Slip) -> Diagnostic | None:
    return slip.make_diagnostic("E129") if "NUMBER" in slip.accepted_kinds else None


def _report_text(slip: Slip) -> Diagnostic | None:
    """Report errors in the path of a `use`, in the title of a `scene`, and in words after them."""
    if slip.accepted_kinds == {"STRING"} and slip.kind(0) in ("NAME", "PATH"):
        return slip.make_diagnostic("E101", help=suggest_text(f'"{slip.text(0)}"'))
    if slip.accepted_kinds == {"AS"}:
        return slip.make_diagnostic("E101", help=f"write `use {slip.text(-1)} as name`")
    return None


def _report_unexpected_token(slip: Slip) -> Diagnostic:
    return slip.make_diagnostic("E101")


Check = Callable[[Slip], Diagnostic | None]
CHECKS: tuple[Check, ...] = (
    _report_second_declaration,
    _report_foreign_word,
    _report_missing_equals,
    _report_junk,
    _report_unclosed_bracket,
    _report_wrong_closing_bracket,
    _report_too_few_items,
    _report_misplaced_comma,
    _report_foreign_operator,
    _report_single_equals,
    _report_reserved_word,
    _report_unjoined_unit,
    _report_missing_comma,
    _report_misplaced_unit,
    _report_declaration_start,
    _report_missing_value,
    _report_text,
    _report_unexpected_token,
)


# ------------------------------------------------------- several declarations on one line


def second_declaration(tokens: Sequence[Token], index: int) -> int | None:
    """Return the index where a second declaration starts near the unexpected `tokens[index]`; None if none does."""
    for start in (index, index - 1):
        if start < 2 or not _starts_declaration(tokens[start : start + 3]):
            continue
        if END in acceptable_kinds(load(), tokens[:start], "declaration"):
            return start
    return None


def _starts_declaration(tokens: Sequence[Token]) -> bool:
    first, *rest = tokens
    if first.kind in WORDS:
        return True
    is_name = first.kind in ("NAME", "UNIT") and re.fullmatch(r"[A-Za-z_]\w*", first.text, re.ASCII)
    return bool(is_name) and [token.kind for token in rest] == ["NAME", "EQUAL"]


def declared_names(tokens: Sequence[Token]) -> list[str]:
    """Return the name, if any, that a declaration with an error was meant to declare, as a list."""
    kinds = [token.kind for token in tokens[:4]]
    if kinds[:2] in (["PARAM", "NAME"], ["NAME", "NAME"]):
        return [tokens[1].text]
    return [tokens[3].text] if kinds == ["USE", "STRING", "AS", "NAME"] else []

"""LALR parser driver for the tokens of one declaration; it uses no recursion, so no depth can exhaust the stack."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from softmark.grammar.lexer import Token
from softmark.grammar.parse_table import ParseTable, Rule

END = "$END"

Builder = Mapping[str, Callable[[list[Any]], Any]]


@dataclass(frozen=True, slots=True)
class UnexpectedToken:
    """Token `tokens[index]` that the parser cannot accept."""

    index: int


def run(table: ParseTable, build: Builder, tokens: Sequence[Token], start: str) -> Any | UnexpectedToken:
    """Return the value of a sequence of tokens, or the first token that the parser cannot accept.

    The last token must be of kind `END`; otherwise it raises ValueError. The method is shift-reduce parsing with
    look-ahead sets computed by lark.
    Source: Knuth 1965; DeRemer and Pennello 1982.
    """
    rows, rules, end = table.states, table.rules, table.ends[start]
    states: list[int] = [table.starts[start]]
    values: list[Any] = []
    for index, token in enumerate(tokens):
        kind = token.kind
        while (action := rows[states[-1]].get(kind)) is not None and action < 0:
            rule = rules[-1 - action]
            if rule.hands_on:
                states[-1] = rows[states[-2]][rule.origin]
            else:
                size = rule.size
                values[-size:] = [_reduce(rule, build, values[-size:])]
                del states[-size:]
                states.append(rows[states[-1]][rule.origin])
            if kind == END and states[-1] == end:
                return values[-1]
        if action is None:
            return UnexpectedToken(index)
        states.append(action)
        values.append(token)
    raise ValueError("the tokens do not end with END")


def _reduce(rule: Rule, build: Builder, values: list[Any]) -> Any:
    if not rule.inline:
        return build[rule.method](_splice(rule, values) if rule.spliced else values)
    if rule.spliced == [0]:  # a list that grows at its end grows in place
        values[0].extend(values[i] for i in rule.kept[1:])
        return values[0]
    return [values[i] for i in rule.kept]


def _splice(rule: Rule, values: list[Any]) -> list[Any]:
    flat: list[Any] = []
    for i, value in enumerate(values):
        if i in rule.spliced:
            flat.extend(value)
        else:
            flat.append(value)
    return flat


def acceptable_kinds(table: ParseTable, tokens: Sequence[Token], start: str) -> frozenset[str]:
    """Return the kinds of token that may follow `tokens`, which must not contain the kind `END`."""
    states = [table.starts[start]]
    for token in tokens:
        states = _push_token(table, states, token.kind) or states
    kinds = [terminal.name for terminal in table.terminals] + [END]
    return frozenset(kind for kind in kinds if _push_token(table, states, kind, table.ends[start]))


def _push_token(table: ParseTable, states: list[int], kind: str, end: int = -1) -> list[int] | None:
    """Return the stack of parser states after a token, without values; None if the token cannot be accepted."""
    states = list(states)
    while (action := table.states[states[-1]].get(kind)) is not None and action < 0:
        rule = table.rules[-1 - action]
        del states[-rule.size :]
        states.append(table.states[states[-1]][rule.origin])
        if kind == END and states[-1] == end:
            return states
    return None if action is None else [*states, action]

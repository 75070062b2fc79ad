"""Text that a parser must not be given, or must not hand on: too deep, too long, too many parts."""

import json

import pytest

from daq.untrusted.bounded_text import LEVELS_LIMIT, parse_json, parse_toml


@pytest.mark.parametrize(
    ("parse", "text"),
    [
        (parse_toml, lambda depth: "a = " + "[" * (depth - 1) + "]" * (depth - 1)),
        (parse_toml, lambda depth: "a = " + "{a = " * (depth - 2) + "{}" + "}" * (depth - 2)),
        (parse_json, lambda depth: "[" * depth + "]" * depth),
        (parse_json, lambda depth: '{"a": ' * (depth - 1) + "{}" + "}" * (depth - 1)),
    ],
    ids=["toml arrays", "toml tables", "json arrays", "json objects"],
)
def test_too_deep_nesting_is_refused_at_limit(parse, text):
    parse(text(LEVELS_LIMIT))
    for depth in (LEVELS_LIMIT + 2, 300, 100_000):
        with pytest.raises(ValueError, match="nested"):
            parse(text(depth))


def test_slow_parsing_text_is_refused():
    assert parse_toml("a.b.c = 1") == {"a": {"b": {"c": 1}}}
    with pytest.raises(ValueError, match="parts"):
        parse_toml("a" + ".a" * 10_000 + " = 1")
    with pytest.raises(ValueError, match="characters"):
        parse_toml("# " + "x" * (1 << 20))
    # Points within a string part nothing.
    dots = "." * 10_000
    assert parse_toml(f"a = {json.dumps(dots)}") == {"a": dots}

"""Text that others wrote, as it may be shown: nothing unseen in it, nothing lost of it."""

import ast
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.untrusted.visible_text import visible, visible_line


@pytest.mark.parametrize(
    ("sign", "shown"),
    [
        ("\x1b", "\\x1b"), ("\x07", "\\x07"), ("\x7f", "\\x7f"), ("\x9b", "\\x9b"), ("\r", "\\x0d"),
        ("\u202a", "\\u202a"), ("\u202e", "\\u202e"), ("\u2066", "\\u2066"), ("\u2069", "\\u2069"),
        ("\u200e", "\\u200e"), ("\u200f", "\\u200f"), ("\u061c", "\\u061c"), ("\u200b", "\\u200b"),
        ("\u200d", "\\u200d"), ("\ufeff", "\\ufeff"), ("\u00ad", "\\xad"), ("\u2028", "\\u2028"),
        ("\u034f", "\\u034f"), ("\u3164", "\\u3164"), ("\ufe0f", "\\ufe0f"), ("\ud800", "\\ud800"),
        ("\U000e0041", "\\U000e0041"), ("\U000e0101", "\\U000e0101"),
    ],
)  # fmt: skip
def test_invisible_characters_become_escapes(sign, shown):
    assert visible(f"SN {sign}4") == visible_line(f"SN {sign}4") == f"SN {shown}4"


def test_visible_characters_are_unchanged():
    text = "SN [/x] 4 ± Ω ü 日本 é [b] <i> \\u"
    assert visible(text) == visible_line(text) == text
    assert visible("a\n\tb") == "a\n\tb"
    assert visible_line("a\n\tb") == "a\\n\\tb"


@given(st.text(st.characters(exclude_categories=())))
def test_any_text_becomes_visible(text):
    for shown, kept in ((visible(text), "\n\t"), (visible_line(text), "")):
        unseen = {c for c in shown if unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp")}
        assert unseen <= set(kept)
        shown.encode()
        if "\\" not in text:
            # The escapes are Python's: nothing is lost.
            quoted = shown.replace('"', '\\"').replace("\n", "\\n")
            assert ast.literal_eval(f'"{quoted}"') == text

"""Text for 80 columns: where it breaks, what it takes, and that nothing of it is lost."""

import unicodedata

from hypothesis import given
from hypothesis import strategies as st

from tui.text.layout import columns_of, table_lines, wrapped

texts = st.text(st.characters(codec="utf-8"), max_size=60)


def test_text_breaks_between_words_if_possible():
    assert wrapped("one two three", 8, "  ") == ["one two", "  three"]
    assert wrapped("abcdefghij kl", 4) == ["abcd", "efgh", "ij", "kl"]
    assert wrapped("", 4) == [""]
    assert wrapped("歯車装置", 5) == ["歯車", "装置"]


@given(text=texts, width=st.integers(8, 80), indent=st.sampled_from(["", "  "]))
def test_lines_keep_width_and_all_characters(text, width, indent):
    lines = wrapped(text, width, indent)
    assert all(columns_of(line) <= width for line in lines)
    said = "".join("".join(lines).split())
    assert said == "".join("".join(wrapped(text, 10_000)).split())
    # What would be an order to a terminal is shown.
    assert not any(unicodedata.category(sign) == "Cc" for sign in said)


def test_table_wraps_widest_cells_allowed_to():
    rows = [("1", "a long name of a unit", "x" * 20), ("22", "b", "y")]
    assert table_lines(("id", "unit", "state"), rows, may_wrap=(1,), width=36) == [
        "id  unit        state",
        "--  ----------  --------------------",
        "1   a long      xxxxxxxxxxxxxxxxxxxx",
        "    name of a",
        "    unit",
        "22  b           y",
    ]


@given(rows=st.lists(st.tuples(texts, texts), max_size=4))
def test_table_of_any_text_keeps_its_width(rows):
    lines = table_lines(("unit", "serial"), rows, may_wrap=(0, 1), width=40)
    assert all(columns_of(line) <= 40 for line in lines)

"""Text that others wrote, as it may be shown: every character that is not seen is written out.

Owns which characters are escaped, and how. A control character drives a terminal, a change of
direction (U+202E) turns what stands beside it around, one without width makes two names look the
same. Stored text is never changed: this is for the moment at which it is shown. It prints nothing.
"""

from __future__ import annotations

import re

__all__ = ["visible", "visible_line"]

# Characters that Python calls printable and that show nothing: combining grapheme joiner, Hangul
# fillers, inherent Khmer vowels, Mongolian and other variation selectors (Unicode's
# Default_Ignorable_Code_Point; those of the categories Cc, Cf, Cs, Zl and Zp are not printable).
_UNSEEN = re.compile(
    "[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u3164\ufe00-\ufe0f\uffa0\U000e0100-\U000e01ef]"
)


def visible(text: str) -> str:
    r"""Text of which every character is seen; line breaks and tabs stay.

    Escapes are written as in Python: ``\x1b``, ``\u202e``, ``\U000e0041``.

    >>> print(visible("SN\u202e4\x1b[2J"))
    SN\u202e4\x1b[2J
    """
    if text.isprintable() and not _UNSEEN.search(text):
        return text
    return "".join(sign if sign in "\n\t" else _shown(sign) for sign in text)


def visible_line(text: str) -> str:
    r"""The same on one line: line breaks and tabs are escaped as well.

    >>> print(visible_line("a\nb"))
    a\nb
    """
    return visible(text).replace("\n", "\\n").replace("\t", "\\t")


def _shown(sign: str) -> str:
    if sign.isprintable() and not _UNSEEN.match(sign):
        return sign
    code = ord(sign)
    if code < 0x100:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"

"""Unit files as a person writes them: the sections that a drive may have besides the usual ones.

Owns the choice of sections and the text that comes of it. It asks for no value.
"""

from tui.units.parts import ask_parts, commented, with_parts

__all__ = ["ask_parts", "commented", "with_parts"]

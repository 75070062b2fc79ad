"""Words in large letters, of full blocks, for eyes some metres away.

Owns the shapes of the letters. It knows nothing of what is said with them.
"""

from __future__ import annotations

__all__ = ["HEIGHT", "large"]

HEIGHT = 5
_SHAPES = {
    "A": (" ### ", "#   #", "#####", "#   #", "#   #"),
    "C": (" ####", "#    ", "#    ", "#    ", " ####"),
    "D": ("#### ", "#   #", "#   #", "#   #", "#### "),
    "E": ("#####", "#    ", "###  ", "#    ", "#####"),
    "F": ("#####", "#    ", "###  ", "#    ", "#    "),
    "G": (" ####", "#    ", "#  ##", "#   #", " ####"),
    "I": ("###", " # ", " # ", " # ", "###"),
    "L": ("#    ", "#    ", "#    ", "#    ", "#####"),
    "M": ("#   #", "## ##", "# # #", "#   #", "#   #"),
    "N": ("#   #", "##  #", "# # #", "#  ##", "#   #"),
    "O": (" ### ", "#   #", "#   #", "#   #", " ### "),
    "P": ("#### ", "#   #", "#### ", "#    ", "#    "),
    "R": ("#### ", "#   #", "#### ", "#  # ", "#   #"),
    "S": (" ####", "#    ", " ### ", "    #", "#### "),
    "T": ("#####", "  #  ", "  #  ", "  #  ", "  #  "),
    "U": ("#   #", "#   #", "#   #", "#   #", " ### "),
    "W": ("#   #", "#   #", "# # #", "## ##", "#   #"),
    "Y": ("#   #", " # # ", "  #  ", "  #  ", "  #  "),
}
_UNKNOWN = ("?????",) * HEIGHT


def large(word: str, columns: int) -> str:
    """A word of capital letters, twice as wide where there is room; the word itself where none is.

    Parameters
    ----------
    columns
        Width that there is.
    """
    shapes = [_SHAPES.get(letter, _UNKNOWN) for letter in word]
    rows = [" ".join(shape[row] for shape in shapes) for row in range(HEIGHT)]
    if rows and len(rows[0]) > columns:
        return word
    times = 2 if rows and 2 * len(rows[0]) <= columns else 1
    return "\n".join("".join(("█" if one == "#" else " ") * times for one in row) for row in rows)

"""``python -m tui``: the same as ``lashbench``.

Owns nothing. It loads the entry alone, which sees to the rest.
"""

import sys

from tui.entry import main

if __name__ == "__main__":
    sys.exit(main())

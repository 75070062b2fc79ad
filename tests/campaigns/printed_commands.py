"""Run everything that the pages print, in full and in their order, as a newcomer would.

The tests do the same with short sweeps and without what takes minutes.
``python tests/campaigns/printed_commands.py [PAGE ...]``; exits 1 if anything fails.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
import traceback
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from outputs.printed import ROOT, Newcomer, pages, pieces, stocked_history  # noqa: E402

ELSEWHERE = {ROOT / "docs" / "instrument.md"}
"""Its Python wants an address as its argument and has a test of its own."""


def type_page(page: Path) -> bool:
    """Do what one page prints; whether all of it worked."""
    printed = [p for p in pieces(page) if page not in ELSEWHERE or p[0] == "command"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "folder"
        data = Path(name) / "data" / "lashbench"
        folder.mkdir()
        data.mkdir(parents=True)
        os.chdir(folder)
        os.environ["XDG_DATA_HOME"] = str(data.parent)
        if any("--resume 12" in text for _, text in printed):
            stocked_history(data / "lashbench.db")
        try:
            with Newcomer(folder, full=True) as newcomer:
                for kind, text in printed:
                    if kind != "printed":
                        began_s = time.monotonic()
                        newcomer.run(kind, text)
                        shown = text.splitlines()[0]
                        print(f"  {time.monotonic() - began_s:6.1f} s  {shown}", flush=True)
        except Exception:
            traceback.print_exc()
            return False
        finally:
            os.chdir(ROOT)
    return True


def main(names: list[str]) -> int:
    """Type the pages named, or all."""
    failed = []
    for page in [Path(name).resolve() for name in names] or pages():
        print(page.relative_to(ROOT), flush=True)
        if not type_page(page):
            failed.append(page)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""Draw the sets of a paired study and write them to a folder, with their truths.

Owns the folder: one HDF5 file a set, `truth.jsonl`, and `tasks.jsonl` without the truths. Sets
that are there are kept. It must not look at any answer.

    python tests/studies/draw.py SEED FOLDER [--datasheet SHARE] [KIND=COUNT ...]
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from studies.drawn_sets import DATASHEET, KINDS, draw_set, study_sets

from daq.formats import write_response
from sim.unit import load_unit

_TABLE_1_EXACT = ("N_1", "N", "b_t_deg", "L_a")
"""Values of Table 1 that do not deviate: gear ratios are counted, and b_t is a cause."""


def main() -> None:
    """Draw what is missing."""
    parser = argparse.ArgumentParser()
    parser.add_argument("seed", type=int)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--datasheet", type=float)
    parser.add_argument("counts", nargs="*")
    given = parser.parse_intermixed_args()
    kinds = {k: int(n) for k, _, n in (c.partition("=") for c in given.counts)} or KINDS
    given.folder.mkdir(parents=True, exist_ok=True)
    truths = given.folder / "truth.jsonl"
    lines = truths.read_text().splitlines() if truths.exists() else []
    known = {json.loads(line)["set"] for line in lines}
    for one in study_sets(given.seed, kinds):
        if one.name in known:
            continue
        datasheet = DATASHEET
        if given.datasheet is not None:
            symbols = tuple(s for s in load_unit(one.unit).parameters if s not in _TABLE_1_EXACT)
            datasheet = given.datasheet, symbols
        drawn = draw_set(one, datasheet)
        write_response(drawn.response, given.folder / f"{one.name}.h5")
        truth = drawn.truth()
        task = {name: truth[name] for name in ("set", "unit", "withheld")}
        for file, content in ((truths, truth), (given.folder / "tasks.jsonl", task)):
            with file.open("a") as stream:
                stream.write(json.dumps(content) + "\n")
    print(f"{len(truths.read_text().splitlines())} sets in {given.folder}")


if __name__ == "__main__":
    main()

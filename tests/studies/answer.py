"""Answer the sets of a paired study by one version of the software.

Owns one file of answers, a line of JSON a set; answers that are there are kept. Run it with the
interpreter of the version in question, by the path of this file. It must not read a truth.

    PYTHON tests/studies/answer.py FOLDER ANSWERS [--part K/N] [--tolerance SHARE]
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path

from analysis.diagnosis import diagnose_response
from daq.formats import read_response
from sim.unit import load_unit

KEPT = (
    "verdict",
    "causes",
    "rivals",
    "contribution_ratio",
    "baseline",
    "extended",
    "simulated_s",
)
"""Fields of the JSON document that a study looks at."""


def main() -> None:
    """Answer what is not answered yet."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("answers", type=Path)
    parser.add_argument("--part", default="0/1")
    given = parser.parse_args()
    part, parts = map(int, given.part.split("/"))
    given.answers.parent.mkdir(parents=True, exist_ok=True)
    tasks = [json.loads(line) for line in (given.folder / "tasks.jsonl").read_text().splitlines()]
    cache = Path(os.environ.get("STUDY_CACHE", "build/study-cache"))
    for place, task in enumerate(tasks):
        done = given.answers.read_text().splitlines() if given.answers.exists() else []
        if place % parts != part or task["set"] in {json.loads(line)["set"] for line in done}:
            continue
        response = read_response(given.folder / f"{task['set']}.h5")
        used_s = time.process_time()
        found = diagnose_response(
            response, load_unit(task["unit"]), without=task["withheld"], cache=cache, seed=place
        )
        answer = {"set": task["set"], "processor_s": time.process_time() - used_s}
        content = found.to_json()
        answer |= {name: content[name] for name in KEPT}
        with given.answers.open("a") as stream:
            stream.write(json.dumps(answer) + "\n")
        print(task["set"], answer["verdict"], [c["effect"] for c in answer["causes"]], flush=True)


if __name__ == "__main__":
    main()

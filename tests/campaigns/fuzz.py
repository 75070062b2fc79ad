"""The fuzz campaign: a million executions against everything that reads what others wrote.

Run as ``python tests/campaigns/fuzz.py [--runs N] [--seed S] [--only NAME]
[--write]``, or as ``make fuzz``. It needs the extra ``fuzz`` (atheris, which
is libFuzzer for Python): coverage of our own code guides what is tried next.
Each target runs in a process of its own, which a crash, ten seconds without an
end or 2 GiB of memory end. Where a child process reads, that child has a bound of its
own in processor time, and only its end is waited for. The input that ended a process is
kept in ``.fuzz/``, and so are all inputs that reached something new, from which the next
campaign goes on, and the last result of each target, of which ``--report`` makes the
table. The runs are shared out by what can go wrong in a target and by how slow it is.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests"))

PAGE = ROOT / "docs" / "reliability.md"
KEPT = ROOT / ".fuzz"
BEGIN, END = "<!-- fuzz begins -->", "<!-- fuzz ends -->"
SEED = 20007
SHARES = {
    "csv": 8,
    "hdf5": 6,
    "uff": 6,
    "text": 5,
    "guess": 5,
    "dtt": 3,
    "foreign-uff": 5,
    "mat": 0.1,
    "foreign-mat": 0.1,
    "foreign-h5": 0.1,
    "record": 3,
    "record-mat": 0.1,
    "record-wav": 1,
    "sdf": 7,
    "unit": 7,
    "bench": 7,
    "recipe": 6,
    "transcript": 7,
    "history": 3,
    "block": 6,
    "replies": 6,
    "address": 6,
    "prologix": 6,
    "analyser": 4,
    "adapter": 4,
}
"""Of the runs, by target, per cent; a MATLAB file takes a child process each."""
_CHILDREN = ("mat", "foreign-mat", "foreign-h5", "record-mat")
"""Targets whose files a child process reads, which ends itself after 60 s of processor time or
180 s: on a loaded machine an execution that takes a second of either waits for long."""
_SECONDS, _SECONDS_OF_CHILDREN = 10, 240
_INSTRUMENTED = ["daq", "sim", "sdfascii", "tomllib"]


@dataclass(frozen=True)
class Result:
    """What came of one target."""

    name: str
    runs: int
    coverage: int
    """Edges of our code that were reached."""
    elapsed_s: float
    fault: str


def main() -> int:
    """Run all, print, and perhaps write."""
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("--runs", type=int, default=1_000_000)
    words.add_argument("--seed", type=int, default=SEED)
    words.add_argument("--only", choices=SHARES, help="only that target, with all the runs")
    words.add_argument("--report", action="store_true", help="no run, only the last results")
    words.add_argument("--write", action="store_true", help="write the table into the docs")
    words.add_argument("--inside", help=argparse.SUPPRESS)
    given, rest = words.parse_known_args()
    if given.inside:
        inside(given.inside, rest)
    shares = {given.only: 1} if given.only else SHARES
    if not given.report:
        print(f"{given.runs} runs, seed {given.seed}", flush=True)
        for name, share in shares.items():
            runs = math.ceil(given.runs * share / sum(shares.values()))
            result = outside(name, runs, given.seed)
            (KEPT / f"{name}.json").write_text(json.dumps(asdict(result)), encoding="utf-8")
            print(result, flush=True)
    results = recorded(shares)
    lines = table(results, given.seed)
    print("\n".join(lines))
    if given.write:
        text = PAGE.read_text(encoding="utf-8")
        before, after = text[: text.index(BEGIN)], text[text.index(END) :]
        PAGE.write_text(f"{before}{BEGIN}\n\n" + "\n".join(lines) + f"\n\n{after}", "utf-8")
    return 1 if any(result.fault for result in results) else 0


def outside(name: str, runs: int, seed: int) -> Result:
    """Start the process of one target and read what it said."""
    from worlds.fuzz_targets import seeds

    corpus = KEPT / name
    corpus.mkdir(parents=True, exist_ok=True)
    for number, content in enumerate(seeds(name)):
        (corpus / f"seed-{number}").write_bytes(content)
    began = time.monotonic()
    done = subprocess.run(
        [
            sys.executable, __file__, "--inside", name, str(corpus),
            f"-runs={runs}", f"-seed={seed}",
            f"-timeout={_SECONDS_OF_CHILDREN if name in _CHILDREN else _SECONDS}",
            "-rss_limit_mb=2048",
            f"-artifact_prefix={KEPT}/{name}-", "-max_len=70000" if name == "history" else
            "-max_len=20000", "-print_final_stats=1",
        ],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", check=False,
    )  # fmt: skip
    covered = [int(number) for number in re.findall(r"cov: (\d+)", done.stdout)]
    # The last is that of the end; what a fault ends has told how far it was before.
    executed = re.findall(r"^(?:#|stat::number_of_executed_units: )(\d+)", done.stdout, re.M)
    fault = ""
    if done.returncode:
        said = re.findall(r"^(?:\w*Error\b.*|.*ERROR: libFuzzer.*)", done.stdout, re.MULTILINE)
        fault = "; ".join(said)[:300] or done.stdout[-300:]
    if done.returncode < 0:
        fault = f"ended by {signal.Signals(-done.returncode).name}; {fault}"
    return Result(
        name,
        int(executed[-1]) if executed else 0,
        max(covered, default=0),
        time.monotonic() - began,
        fault,
    )


def inside(name: str, words: Sequence[str]) -> None:
    """Fuzz one target; does not return."""
    import logging
    import warnings

    import atheris

    with atheris.instrument_imports(include=_INSTRUMENTED):
        # Readers are imported when they are used, which would be too late here.
        for module in ("csv", "hdf5", "uff", "mat", "sdf"):
            import_module(f"daq.formats.{module}")
        import_module("sdfascii")
        from worlds.fuzz_targets import targets
    logging.disable()
    warnings.simplefilter("ignore")
    with targets() as all_targets:
        atheris.Setup([sys.argv[0], *words], all_targets[name])
        atheris.Fuzz()


def recorded(names: Iterable[str]) -> list[Result]:
    """The last result of each of these targets that has one."""
    places = [KEPT / f"{name}.json" for name in names]
    return [Result(**json.loads(p.read_text(encoding="utf-8"))) for p in places if p.exists()]


def table(results: Sequence[Result], seed: int) -> list[str]:
    """What came of it."""
    total = sum(result.runs for result in results)
    hours = sum(result.elapsed_s for result in results) / 3600.0
    faults = sum(bool(result.fault) for result in results)
    lines = [
        f"{total} executions, seed {seed}, {hours:.1f} h; faults: {faults}.",
        "",
        "| target | executions | fault |",
        "| --- | --- | --- |",
    ]
    for result in results:
        lines.append(f"| {result.name} | {result.runs} | {result.fault or '-'} |")
    return lines


if __name__ == "__main__":
    sys.exit(main())

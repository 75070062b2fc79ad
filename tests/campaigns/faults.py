"""The fault campaign: hundreds of sessions with something going wrong in each, judged one by one.

Run as ``python tests/campaigns/faults.py [--runs N] [--seed S] [--lanes N]
[--only NUMBER]``, or as ``make faults``. It prints the seed, every broken
promise as it is found and a table of outcomes, and with ``--write`` puts the
table into docs/reliability.md. It ends with 1 if any promise was broken. Every
outcome is kept as a line of JSON in ``build/faults-SEED.jsonl``; with ``--on``
a campaign goes on where it ended, runs that broke a promise included, and the
table counts what was run again.
"""

from __future__ import annotations

import argparse
import json
import random
import signal
import sys
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests"))

from fault_bench.fault_cases import DISTURBANCES, Case, draw_cases  # noqa: E402
from fault_bench.fault_runs import Campaign, Outcome  # noqa: E402

from sim.models import models  # noqa: E402

PAGE = ROOT / "docs" / "reliability.md"
BEGIN, END = "<!-- campaign begins -->", "<!-- campaign ends -->"
SEED = 20007


def main() -> int:
    """Run, print, and perhaps write."""
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("--runs", type=int, default=800)
    words.add_argument("--gateways", type=int, default=300, help="further runs behind gateways")
    words.add_argument("--seed", type=int, default=SEED)
    words.add_argument("--lanes", type=int, default=4, help="runs at the same time")
    words.add_argument("--minutes", type=float, default=1e6, help="begin no run after that")
    words.add_argument("--only", type=int, help="only the run of that number")
    words.add_argument("--kind", help="only runs with that fault or disturbance")
    words.add_argument("--driver", help="only runs of the driver with that scheme")
    words.add_argument("--wire", help="only runs over that wire")
    words.add_argument("--on", action="store_true", help="only runs not kept, or not well, yet")
    words.add_argument("--write", action="store_true", help="write the table into the docs")
    given = words.parse_args()
    cases = list(draw_cases(given.runs, given.seed, given.gateways))
    if given.only is not None:
        cases = [case for case in cases if case.number == given.only]
    if given.kind is not None:
        cases = [case for case in cases if given.kind in (case.fault_name, case.disturbance)]
    if given.driver is not None:
        cases = [case for case in cases if case.driver == given.driver]
    if given.wire is not None:
        cases = [case for case in cases if case.wire == given.wire]
    # So a campaign that is ended early has been over every driver and wire.
    random.Random(given.seed).shuffle(cases)
    # A shell's background job is started with Ctrl-C ignored, and so would be its programs.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    kept = ROOT / "build" / f"faults-{given.seed}.jsonl"
    kept.parent.mkdir(exist_ok=True)
    if not given.on:
        kept.unlink(missing_ok=True)
    well = {outcome.case for outcome in recorded(kept) if not outcome.wrongs}
    cases = [case for case in cases if case not in well]
    print(f"{len(cases)} runs, seed {given.seed}", flush=True)
    run_all(cases, given.lanes, time.monotonic() + 60.0 * given.minutes, kept)
    last = {outcome.case: outcome for outcome in recorded(kept)}
    outcomes = sorted(last.values(), key=lambda outcome: outcome.case.number)
    lines = table(outcomes, given.seed, len(recorded(kept)) - len(outcomes))
    print("\n".join(lines))
    if given.write:
        write(lines)
    return 1 if any(outcome.wrongs for outcome in outcomes) else 0


def run_all(cases: Sequence[Case], lanes: int, latest_s: float, kept: Path) -> None:
    """Some at a time: most of a run is waiting. None is begun after `latest_s`."""
    campaign = Campaign()

    def run(case: Case) -> Outcome | None:
        return campaign.run(case) if time.monotonic() < latest_s else None

    with ThreadPoolExecutor(lanes) as pool, kept.open("a", encoding="utf-8") as lines:
        running = [pool.submit(run, case) for case in cases]
        for done, future in enumerate(as_completed(running), 1):
            outcome = future.result()
            if outcome is None:
                continue
            lines.write(json.dumps(asdict(outcome)) + "\n")
            lines.flush()
            for wrong in outcome.wrongs:
                print(f"BROKEN  {outcome.case}\n        {wrong}", flush=True)
            if done % 50 == 0:
                print(f"{done} of {len(cases)}", flush=True)


def recorded(kept: Path) -> list[Outcome]:
    """Every outcome of the campaign so far, in the order in which they came."""
    lines = kept.read_text(encoding="utf-8").splitlines() if kept.exists() else []
    found = [json.loads(line) for line in lines]
    return [Outcome(**{**outcome, "case": Case(**outcome["case"])}) for outcome in found]


def table(outcomes: Sequence[Outcome], seed: int, repeated: int) -> list[str]:
    """What came of it, with a row for each fault and disturbance that broke a promise."""
    drivers = Counter(outcome.case.driver or "35670a" for outcome in outcomes)
    wires = Counter(outcome.case.wire for outcome in outcomes)
    shown = [", ".join(f"{name} {n}" for name, n in sorted(of.items())) for of in (drivers, wires)]
    broken = sum(bool(outcome.wrongs) for outcome in outcomes)
    stopped = [o.stopped_s for o in outcomes if o.stopped_s is not None]
    off = [o.off_after_s for o in outcomes if o.off_after_s is not None]
    lines = [
        f"{len(outcomes)} runs, seed {seed}; "
        f"{'; '.join(shown)}. "
        f"Broken promises: {broken}; runs made again: {repeated}. Longest session: "
        f"{max(o.elapsed_s for o in outcomes):.0f} s "
        f"({max(o.elapsed_s - o.starved_s for o in outcomes):.0f} s with a free processor). "
        f"Longest time to the source off: {max(off, default=0.0):.1f} s from the program's end, "
        f"{max(stopped, default=0.0):.1f} s from its stop. More than one session to complete: "
        f"{sum(o.resumes > 1 for o in outcomes)}.",
    ]
    faults = dict.fromkeys(name for model in models() for name in model.faults)
    rows = {}
    for name in (*faults, *DISTURBANCES):
        mine = [o for o in outcomes if name in (o.case.fault_name, o.case.disturbance)]
        if mine:
            rows[name] = mine
    counts = [len(mine) for mine in rows.values()]
    least, most = min(counts), max(counts)
    lines += ["", f"Faults and disturbances: {len(rows)}, in {least} to {most} runs each."]
    if broken:
        lines += [
            "",
            "| what went wrong | runs | struck | source said to be | broken |",
            "| --- | --- | --- | --- | --- |",
        ]
        lines += [_row(n, mine) for n, mine in rows.items() if any(o.wrongs for o in mine)]
    return lines


def _row(name: str, mine: Sequence[Outcome]) -> str:
    sources = Counter(outcome.source or "not touched" for outcome in mine)
    cells = [
        f"`{name}`",
        str(len(mine)),
        str(sum(o.fault_struck if o.case.fault_name == name else o.disturbed for o in mine)),
        ", ".join(f"{state} {sources[state]}" for state in sorted(sources)),
        str(sum(bool(outcome.wrongs) for outcome in mine)),
    ]
    return f"| {' | '.join(cells)} |"


def write(lines: Sequence[str]) -> None:
    """Put the table between its marks."""
    text = PAGE.read_text(encoding="utf-8")
    before, after = text[: text.index(BEGIN)], text[text.index(END) :]
    PAGE.write_text(f"{before}{BEGIN}\n\n" + "\n".join(lines) + f"\n\n{after}", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())

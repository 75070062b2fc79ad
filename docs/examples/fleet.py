"""Which unit wears? python fleet.py HISTORY: the trend of stage 1's play for every unit in it.

`lashbench history --estimate all` makes the estimates that this reads; `diagnose` in the screen
keeps the diagnoses.
"""

import sys
from collections import defaultdict
from datetime import datetime

from analysis.answer import accept_model
from analysis.trend import fit_trend
from daq.store import Store

rows = defaultdict(list)
with Store(sys.argv[1], read_only=True) as store:
    for line in store.each_line():
        estimate, diagnosis = (one and one.summary for one in (line.estimate, line.diagnosis))
        # The accepted model's; None where the plain model is refuted and nothing was diagnosed.
        b1 = accept_model(estimate, diagnosis).b1_deg
        if b1 is not None:
            moment_s = datetime.fromisoformat(line.started).timestamp()
            rows[line.unit, line.serial].append((moment_s, b1["value"], b1["std"]))

for (unit, serial), sessions in sorted(rows.items()):
    trend = fit_trend(*zip(*sessions, strict=True))
    line = f"{unit} {serial}: {len(sessions)} sessions, "
    line += f"b1 {trend.mean:.4f} +- {trend.mean_std:.4f} deg"
    if trend.slope_per_day is not None and trend.slope_std:
        slope, std = 30 * trend.slope_per_day, 30 * trend.slope_std
        verdict = "WEARS" if slope > 3 * std else "steady"
        line += f", {slope:+.4f} +- {std:.4f} deg a month: {verdict}"
    print(line)

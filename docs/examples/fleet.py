"""Which unit wears? python fleet.py HISTORY: the trend of stage 1's play for every unit in it.

`lashbench history --estimate all` makes the estimates that this reads.
"""

import sys
from collections import defaultdict
from datetime import datetime

from analysis.trend import fit_trend
from daq.store import Store

rows = defaultdict(list)
with Store(sys.argv[1], read_only=True) as store:
    estimates = store.latest_estimates()
    for measurement in store.measurements():
        found = estimates.get(measurement.id)
        if found is None or "b1_deg" not in found.document:
            continue
        if measurement.ended is None or found.made <= measurement.ended:
            continue  # points were taken since
        moment_s = datetime.fromisoformat(measurement.started).timestamp()
        b1 = found.document["b1_deg"]
        rows[measurement.header.unit, measurement.header.serial].append(
            (moment_s, b1["value"], b1["std"])
        )

for (unit, serial), sessions in sorted(rows.items()):
    trend = fit_trend(*zip(*sessions, strict=True))
    line = f"{unit} {serial}: {len(sessions)} sessions, "
    line += f"b1 {trend.mean:.4f} +- {trend.mean_std:.4f} deg"
    if trend.slope_per_day is not None and trend.slope_std:
        slope, std = 30 * trend.slope_per_day, 30 * trend.slope_std
        verdict = "WEARS" if slope > 3 * std else "steady"
        line += f", {slope:+.4f} +- {std:.4f} deg a month: {verdict}"
    print(line)

"""``lashbench correct``: mend what was said of a stored measurement, with an audit trail.

Owns the options of the verb. What may be corrected, and that the old values stay,
is the history's part.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

from cyclopts import Parameter

from daq.errors import InputError
from tui.measurements.history_rows import correction_words
from tui.options import HistoryOption, Json, Whole
from tui.places import history_path
from tui.text.output import Injected

__all__ = ["correct"]


def correct(
    measurement: Annotated[Whole, Parameter(help="Identifier, as `history` lists it.")],
    /,
    *,
    db: HistoryOption = None,
    serial: str | None = None,
    operator: str | None = None,
    notes: Annotated[str | None, Parameter(name=["--notes", "--note"])] = None,
    by: str | None = None,
    json: Json = False,
    console: Injected,
) -> None:
    """Correct serial number, operator or notes of a stored measurement.

    What stood there before stays in the measurement's audit trail, with who corrected it and
    when. The trail goes into every file that is exported, and is printed here; without a
    value to correct it is printed alone.

    Parameters
    ----------
    db
        The bench's history, a file or postgresql://USER@HOST/DATABASE; yours, if left out.
    serial
        Serial number as it should be.
    operator
        Operator as it should be.
    notes
        Notes as they should be.
    by
        Who corrects.
    """
    from daq.store import Store
    from tui.measure_options import check_printable

    given = {"serial": serial, "operator": operator, "notes": notes}
    changes = {name: value for name, value in given.items() if value is not None}
    path = history_path(db)
    if changes:
        if by is None or not by.strip():
            raise InputError("a correction says who made it; give --by NAME")
        check_printable({**changes, "by": by})
        with Store(path) as store:
            done = store.correct(measurement, by.strip(), changes)
        words = ", ".join(one.field for one in done) or "nothing: it says so already"
        console.note(f"measurement {measurement}: corrected {words}")
    elif by is not None:
        raise InputError("nothing to correct; give --serial, --operator or --notes")
    with Store(path, read_only=True) as store:
        store.measurement(measurement)
        trail = store.corrections(measurement)
    if json:
        console.document({"id": measurement, "corrections": [asdict(one) for one in trail]})
    elif trail:
        console.data("\n".join(f"#{measurement}: {correction_words(one)}" for one in trail))
    else:
        console.data(f"#{measurement}: nothing was corrected")

"""A history that somebody altered, read by every verb: it is read, or refused in one line.

The files are real SQLite files. Each example alters one as SQL can, anywhere, and then lists,
exports, corrects, replays and reports; the report takes stored answers, which may be altered, too.
"""

import json
import sqlite3
import subprocess
import sys
from contextlib import closing

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from instruments.measuring import measuring
from outputs.screen import DIAGNOSIS, ESTIMATE, operated, run

from daq.store import Store
from sim.unit import load_unit
from tui import cli
from tui.measurements.stored_answers import keep_diagnosis, keep_estimate

TABLES = ("units", "instruments", "plans", "measurements", "points", "events", "estimates",
          "diagnoses", "diagnosed_points", "corrections")  # fmt: skip
DOCUMENTS = [("estimates", "document"), ("estimates", "summary"), ("diagnoses", "document"),
             ("diagnoses", "summary"), ("plans", "document"), ("plans", "levels"),
             ("measurements", "configurations"), ("measurements", "readback"),
             ("points", "detail"), ("events", "data"), ("instruments", "options")]  # fmt: skip
VALUES = st.one_of(
    st.none(), st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(), st.text(max_size=20),
    st.binary(max_size=20),
    st.sampled_from(["", "{}", "[]", "null", "1e999", "[1e999]", "NaN", "[" * 5000, "9" * 400,
                     '{"contribution_ratio": {"value": "x"}}', "2026-13-40",
                     "2026-01-01T00:00:00", "complete", "confirmed-off", "x" * 70_000]),
)  # fmt: skip
JSON_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**70), 2**70) | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=5,
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A history with one of everything."""
    path = tmp_path_factory.mktemp("whole") / "bench.db"
    words = [*measuring("--serial", "S"), "--db", str(path), "--quiet"]
    assert cli.main(list(map(str, words))) == 0
    with Store(path) as store:
        store.correct(1, "me", {"notes": "cold"})
        measured, response = store.measurement(1), store.response(1)
    keep_estimate(path, measured, ESTIMATE)
    keep_diagnosis(path, 1, [response], load_unit("adss"), DIAGNOSIS)
    with closing(sqlite3.connect(path)) as raw:
        raw.execute("PRAGMA journal_mode = DELETE")
    return path.read_bytes()


def verbs(path, out):
    db = ["--db", str(path)]
    return [
        ["history", "--estimate", "none", *db],
        ["history", "--estimate", "none", "--json", *db],
        ["export", "1", "--out", str(out / "x.csv"), *db],
        ["correct", "1", *db],
        ["correct", "1", "--serial", "T", "--by", "me", *db],
    ]


def fresh(path, content):
    """Write a history where another one was."""
    for beside in path.parent.glob(f"{path.name}-*"):
        beside.unlink()
    path.write_bytes(content)


def report(path, out):
    return ["report", "1", "--unit", "adss", "--no-diagnose", "--out", str(out / "r.html"),
            "--db", str(path)]  # fmt: skip


def ends_well(words, capsys):
    """Run a verb: done, or one line that says which file it is about, and exit code 2."""
    code = cli.main(words)
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert code in (0, 1, 2), (words, code, said)
    assert "internal" not in "".join(said), (words, said)
    assert len(said) == (code != 0), (words, said)


def altered(path, statement, values=()):
    """Run a statement that SQLite itself may refuse."""
    with closing(sqlite3.connect(path, isolation_level=None)) as raw:
        raw.execute("PRAGMA foreign_keys = OFF")
        raw.execute("PRAGMA ignore_check_constraints = ON")
        try:
            raw.execute(statement, values)
        except sqlite3.Error:
            return


FUZZ = settings(
    max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture], derandomize=True
)


@FUZZ
@given(data=st.data())
def test_any_column_value_is_read_or_refused(whole, tmp_path, capsys, data):
    path = tmp_path / "bench.db"
    fresh(path, whole)
    table = data.draw(st.sampled_from(TABLES))
    with closing(sqlite3.connect(path)) as raw:
        columns = [row[1] for row in raw.execute(f"PRAGMA table_info({table})")]
    column = data.draw(st.sampled_from(columns))
    value = data.draw(VALUES)
    altered(path, f"UPDATE OR REPLACE {table} SET {column} = ?", (value,))
    for words in verbs(path, tmp_path):
        ends_well(words, capsys)


def places_of(document, here=()):
    """Paths to everything in a document of JSON."""
    yield here
    inner = document.items() if isinstance(document, dict) else enumerate(
        document if isinstance(document, list) else ()
    )  # fmt: skip
    for key, value in inner:
        yield from places_of(value, (*here, key))


def with_other(document, place, value):
    if not place:
        return value
    copy = document.copy()
    copy[place[0]] = with_other(document[place[0]], place[1:], value)
    return copy


@FUZZ
@given(data=st.data())
def test_any_document_is_read_or_refused(whole, tmp_path, capsys, data):
    path = tmp_path / "bench.db"
    fresh(path, whole)
    table, column = data.draw(st.sampled_from(DOCUMENTS))
    with closing(sqlite3.connect(path)) as raw:
        (text,) = raw.execute(f"SELECT {column} FROM {table}").fetchone()
    document = json.loads(text)
    place = data.draw(st.sampled_from(list(places_of(document))))
    other = json.dumps(with_other(document, place, data.draw(JSON_VALUES)))
    altered(path, f"UPDATE {table} SET {column} = ?", (other,))
    words = verbs(path, tmp_path)[:3]
    if table in ("estimates", "diagnoses") and column == "document":
        words = [report(path, tmp_path)]
    for some in words:
        ends_well(some, capsys)


LAYOUTS = [
    "CREATE TRIGGER t AFTER INSERT ON corrections BEGIN DELETE FROM points; END",
    "CREATE VIEW v AS SELECT * FROM points",
    "ALTER TABLE units ADD COLUMN bomb TEXT AS (hex(zeroblob(100000000))) VIRTUAL",
    "ALTER TABLE measurements ADD COLUMN more TEXT",
    "ALTER TABLE measurements RENAME COLUMN notes TO remarks",
    "CREATE VIRTUAL TABLE more USING fts5(x)",
    "CREATE TABLE more (x)",
    "CREATE INDEX more ON units (hex(zeroblob(1000000)))",
    "DROP INDEX points_live",
    "DROP TABLE corrections",
]


@pytest.mark.parametrize("statement", LAYOUTS)
def test_any_other_layout_is_refused_unexecuted(whole, tmp_path, capsys, statement):
    """Nothing that the file holds is executed."""
    path = tmp_path / "bench.db"
    path.write_bytes(whole)
    with closing(sqlite3.connect(path)) as raw:
        raw.execute(statement)
        raw.commit()
    before = path.read_bytes()
    for words in [*verbs(path, tmp_path), report(path, tmp_path)]:
        assert cli.main(words) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith(f"error: {path}: ")
    assert path.read_bytes() == before


def test_virtual_table_instead_of_table_is_refused(whole, tmp_path, capsys):
    path = tmp_path / "bench.db"
    path.write_bytes(whole)
    with closing(sqlite3.connect(path)) as raw:
        raw.execute("DROP TABLE points")
        raw.execute("CREATE VIRTUAL TABLE points USING fts5(measurement_id, flags, taken)")
        raw.commit()
    for words in verbs(path, tmp_path):
        assert cli.main(words) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "as a history never does" in line


SIZES = [
    "UPDATE units SET name = hex(zeroblob(15000000))",
    "UPDATE measurements SET notes = zeroblob(30000000)",
    "UPDATE estimates SET summary = '[' || replace(hex(zeroblob(3000000)), '0', '1,') || '1]'",
    "UPDATE plans SET document = '[' || replace(hex(zeroblob(3000000)), '0', '1,') || '1]'",
    "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 400000) "
    "INSERT INTO points SELECT NULL, 1, 2.5, 1000 + i, 1000 + i, 0.1, 0.1, 0.1, 0.1, NULL, NULL, 0,"
    " '{}', '2026-01-01T00:00:00+00:00', NULL FROM n",
]
CALL = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
from tui import cli
code = cli.main(sys.argv[1:])
# Not ru_maxrss: that counts what the parent held when it started this process.
(peak,) = [line for line in open("/proc/self/status") if line.startswith("VmHWM")]
print(code, peak.split()[1])
"""


@pytest.mark.parametrize(
    "statement",
    [*SIZES[::2], *(pytest.param(one, marks=pytest.mark.long) for one in SIZES[1::2])],
)
def test_absurd_sizes_cost_bounded_memory(whole, tmp_path, statement):
    path = tmp_path / "bench.db"
    path.write_bytes(whole)
    # In a process of its own: in this one SQLite takes no more memory than a history needs.
    make = f"import sqlite3; raw = sqlite3.connect({str(path)!r}); raw.execute({statement!r})"
    subprocess.run([sys.executable, "-c", f"{make}; raw.commit()"], check=True)
    words = ["export", "1", "--out", str(tmp_path / "x.csv"), "--db", str(path)]
    if "summary" in statement:
        words = ["history", "--estimate", "none", "--db", str(path)]
    done = subprocess.run(
        [sys.executable, "-c", CALL, *words], capture_output=True, text=True, check=False
    )
    (line,) = done.stderr.splitlines()
    assert line.startswith("error: ")
    code, kib = map(int, done.stdout.split())
    assert code == 2
    assert kib < 600_000


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE estimates SET summary = '{\"contribution_ratio\": 7}'",
        "UPDATE measurements SET started = x'00'",
        "UPDATE plans SET levels = '{}'",
    ],
)
def test_screen_reports_unreadable_history(whole, tmp_path, statement):
    path = tmp_path / "bench.db"
    path.write_bytes(whole)
    altered(path, statement)

    async def way():
        async with operated(path) as op:
            # The first step may have said so already: then its dialog is on top.
            await op.press("7")
            await op.sees("cannot be read", "restore")
            assert op.app.is_running

    run(way)

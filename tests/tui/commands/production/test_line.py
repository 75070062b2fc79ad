"""A production line: units judged rightly, killed on the way, nothing lost or judged twice."""

import io
import json
import os
import sqlite3
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st
from instruments.line_bench import BAD, GOOD, ended, line_bench

from daq.errors import FileFormatError, InputError, LashbenchError
from daq.formats.atomic import append_line
from tui.line.hook import Hook
from tui.line.results import Result, Results
from tui.line.scanner import Scanner, clean_serial
from tui.line.tally import tally_lines


def result(serial="S1", attempt=1, verdict="PASS", measurement=1, **more) -> Result:
    return Result(
        serial=serial, attempt=attempt, verdict=verdict, unit="ADSS", measurement=measurement,
        history="/h.db", started="2026-01-02T03:04:05", ended=None, **more,
    )  # fmt: skip


def scanned(data: bytes) -> list[str]:
    """The lines of a stream that comes in pieces of any size."""
    read, write = os.pipe()
    os.write(write, data)
    os.close(write)
    lines = []
    with os.fdopen(read) as stream:
        scanner = Scanner(stream)
        while (line := scanner.line()) is not None:
            lines.append(line)
    return lines


def test_line_killed_twice_is_judged_correctly(tmp_path):
    """Six units, two of them bad; the table, the labels, the command and the counts agree."""
    told = tmp_path / "told.jsonl"
    script = f"import sys; open({str(told)!r}, 'a').write(sys.stdin.read())"
    hook = ["--on-result", f'{sys.executable} -c "{script}"', "--csv", tmp_path / "results.csv"]
    with line_bench(tmp_path) as bench:
        process = bench.start(*hook)
        assert bench.scan(process, "\x02]C1SN1\t\r").startswith("PASS       SN1  ADSS  ")
        assert bench.scan(process, "SN2", BAD).startswith("FAIL       SN2  ")
        bench.kill_in_mid_unit(process, "SN3", BAD)
        process = bench.start(*hook)
        assert process.stdout.readline().startswith("FAIL       SN3  ADSS  measurement 3")
        # Whoever does not know that it was gone on with scans it again: it is no retest.
        process.stdin.write("SN3\n")
        assert bench.scan(process, "SN4").startswith("PASS       SN4  ")
        bench.kill_in_mid_unit(process, "SN5", GOOD)
        process = bench.start(*hook)
        assert process.stdout.readline().startswith("PASS       SN5  ")
        code, out, _ = ended(process)
        assert not bench.drives
        results = bench.results()
    assert code == 0
    assert [(one["serial"], one["attempt"], one["verdict"]) for one in results] == [
        ("SN1", 1, "PASS"), ("SN2", 1, "FAIL"), ("SN3", 1, "FAIL"), ("SN4", 1, "PASS"),
        ("SN5", 1, "PASS"),
    ]  # fmt: skip
    assert [one["measurement"] for one in results] == [1, 2, 3, 4, 5]
    assert [json.loads(line)["serial"] for line in told.read_text().splitlines()] == [
        "SN1", "SN2", "SN3", "SN4", "SN5",
    ]  # fmt: skip
    assert (tmp_path / "results.csv").read_text().count("\n") == 6
    assert "5 units: 3 PASS, 2 FAIL; 0 retests" in out
    assert "yield 3/5 (60 %), at the first attempt 3/5 (60 %)" in out
    assert "FAIL: SN2, SN3\n  by: ARF at 2 V 2" in out


def test_unwritten_result_is_judged_from_history(tmp_path):
    """A retest is marked."""
    with line_bench(tmp_path) as bench:
        process = bench.start("--on-result", "false")
        assert bench.scan(process, "A", BAD).startswith("FAIL")
        assert "retest 1" in bench.scan(process, "A")
        code, out, err = ended(process)
        assert (code, err.count("it ended with 1; the result is kept")) == (0, 2)
        assert "1 units: 1 PASS; 1 retests" in out
        assert "at the first attempt 0/1" in out
        whole = bench.out.read_bytes()
        # A cut in the middle of the last line: that unit is judged again, and not driven again.
        bench.out.write_bytes(whole[:-40])
        code, out, _ = ended(bench.start())
        assert (code, bench.measurements()) == (0, 2)
        assert out.startswith("PASS       A  ADSS  measurement 2  retest 1")
        again = bench.results()
        assert [one["attempt"] for one in again] == [1, 2]
        assert again[-1]["judgement"] == json.loads(whole.splitlines()[-1])["judgement"]


@pytest.fixture
def here(tmp_path, monkeypatch, capsys):
    """A line in this process, with what is scanned on a pipe; exit code, stdout and stderr."""
    from tui import cli

    with line_bench(tmp_path) as bench:

        def call(serials, *words, terminal=False):
            write, read = os.openpty() if terminal else reversed(os.pipe())
            os.write(write, "".join(f"{serial}\n" for serial in serials).encode())
            if not terminal:
                os.close(write)
            with os.fdopen(read) as stream:
                monkeypatch.setattr(sys, "stdin", stream)
                code = cli.main([str(word) for word in bench.words(*words)])
            if terminal:
                os.close(write)
            return code, *capsys.readouterr()

        yield bench, call


def cut(db, measurement):
    """Leave of a measurement what a crash would: some points, and no end."""
    with sqlite3.connect(db) as opened:
        opened.execute("UPDATE measurements SET state = 'interrupted' WHERE id = ?", [measurement])
        opened.execute(
            "DELETE FROM points WHERE measurement_id = ? AND requested_hz > 150", [measurement]
        )
        opened.execute(
            "UPDATE measurements SET points = "
            "(SELECT count(*) FROM points WHERE measurement_id = measurements.id)"
        )


def serials(path):
    return [json.loads(line)["serial"] for line in path.read_text().splitlines()]


@pytest.mark.long
def test_second_results_file_ignores_the_first(here, tmp_path):
    """Each file has its units: none is judged into another, or driven under an old serial."""
    first, second = tmp_path / "first.jsonl", tmp_path / "second.jsonl"
    bench, run = here
    assert run("A", "--out", first)[0] == 0
    # A complete unit of the first file is not judged into the second.
    code, out, _ = run("", "--out", second)
    assert (code, out, second.exists()) == (0, "no unit yet\n", False)
    assert run("B", "--out", first)[0] == 0
    first.write_text(first.read_text().splitlines(keepends=True)[0])
    cut(bench.db, 2)
    # Another unit is on the bench: it is not measured as B.
    code, out, _ = run("C", "--out", second)
    assert (code, out.startswith("PASS       C  ADSS  measurement 3")) == (0, True)
    # Nor does the first line go on with B by itself now.
    code, out, err = run("D", "--out", first)
    assert (code, out.startswith("PASS       D  ADSS  measurement 4")) == (0, True)
    assert "warning: B is not finished" in err
    assert (serials(first), serials(second)) == (["A", "D"], ["C"])
    assert bench.points(2) < 21


def test_count_and_end_work_at_every_question(here, tmp_path):
    bench, run = here
    out = tmp_path / "results.jsonl"
    code, said, err = run(["A", "A", "?", "."], "--out", out, terminal=True)
    assert (code, serials(out)) == (0, ["A"])
    # The question is asked once more after the counts, and the end is no answer to it.
    assert err.count("measure it again as a retest? [y/N]") == 2
    assert said.count("1 units: 1 PASS; 0 retests") == 2
    assert err.count("serial> ") == 2


def test_pause_between_units_does_not_end_line(here, tmp_path):
    bench, run = here
    out = tmp_path / "results.jsonl"
    hook = ["--on-result", "sh -c 'kill -USR1 $PPID; kill -USR2 $PPID'"]
    code, _, err = run(["A", "A", "A", "B", "."], "--out", out, *hook, terminal=True)
    assert (code, serials(out)) == (0, ["A", "B"])
    assert err.count("nothing is measured now") == 4
    # A code that is scanned twice while its unit is swept is asked about, and it is said.
    assert err.count("A: not measured again") == 1


def test_line_resumes_with_its_own_unit(here, tmp_path):
    first = tmp_path / "first.jsonl"
    bench, run = here
    assert run("A", "--out", first)[0] == 0
    first.unlink()
    cut(bench.db, 1)
    code, out, _ = run("", "--out", first)
    assert (code, out.splitlines()[0]) == (0, "PASS       A  ADSS  measurement 1")
    assert (serials(first), bench.points(1)) == (["A"], 21)


def test_silent_unit_is_reported_failed_bench_stops(tmp_path):
    with line_bench(tmp_path) as bench:
        process = bench.start()
        bench.unit.is_dead = True
        label = bench.scan(process, "DEAD")
        assert label.startswith("UNDECIDED  DEAD  ")
        assert "not measured: a gain of" in label
        bench.unit.is_dead = False
        assert bench.scan(process, "B").startswith("PASS")
    # The analyser is gone.
    process.stdin.write("C\nD\n")
    code, _, err = ended(process)
    assert code == 3
    assert err.rstrip().splitlines()[-1].startswith("error: ")
    assert [one["serial"] for one in bench.results()] == ["DEAD", "B"]


def test_unwritable_table_does_not_stop_line(here, tmp_path):
    bench, run = here
    folder, out = tmp_path / "tables", tmp_path / "results.jsonl"
    folder.mkdir()
    words = ["--out", out, "--csv", folder / "units.csv", "--on-result", f"rm -r {folder}"]
    code, said, err = run(["A", "B"], *words)
    assert (code, serials(out)) == (0, ["A", "B"])
    assert said.index("PASS       B ") > said.index("PASS       A ")
    assert "warning: --csv" in err
    assert f"the result is in {out}" in err
    assert "judged again" not in err


@given(st.text(st.characters(codec="utf-8"), max_size=30))
def test_any_serial_is_cleaned_or_refused(text):
    try:
        serial = clean_serial(text)
    except InputError as error:
        assert "scan it again" in str(error)  # noqa: PT017
        return
    assert serial == serial.strip()
    assert serial.isprintable()
    assert clean_serial(f"\x02 {serial}\x03\r") in (serial, clean_serial(serial))


@pytest.mark.parametrize(
    ("data", "lines"),
    [
        (b"A\nB\n", ["A", "B"]),
        (b"A\rB\r", ["A", "B"]),
        (b"A\r\nB\r\n", ["A", "B"]),
        (b"A\n\nB", ["A", "", "B"]),
        (b"", []),
        (b"\xff\xfe\n", ["��"]),
    ],
)
def test_scanner_line_endings_are_recognised(data, lines):
    assert scanned(data) == lines


@given(st.integers(0, 400))
def test_truncated_results_lose_only_last_line(cut):
    import tempfile
    from pathlib import Path

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "results.jsonl"
        for number in (1, 2):
            Results(path).add(result(f"S{number}", measurement=number))
        data = path.read_bytes()
        path.write_bytes(data[: max(0, len(data) - cut)])
        left = [one.serial for one in Results(path).all]
        assert left == ["S1", "S2"][: len(left)]
        Results(path).add(result("S3", measurement=3))
        assert [one.serial for one in Results(path).all] == [*left, "S3"]


@pytest.mark.parametrize("text", ["serial,verdict\n", '{"serial": 1}\n', "[]\n", "{" * 5000 + "\n",
                                  '{"a": 1}', "notes"])  # fmt: skip
def test_foreign_file_is_not_taken_for_results(tmp_path, text):
    path = tmp_path / "results.jsonl"
    path.write_text(text)
    with pytest.raises(FileFormatError, match="line 1 is no result"):
        Results(path)
    assert path.read_text() == text


def test_a_full_disk_leaves_whole_lines(small_disk):
    path, whole = small_disk / "lines", "x" * 1000
    for _ in range(40):
        append_line(path, whole)
    with pytest.raises(LashbenchError, match="could not be written"):
        append_line(path, 60000 * "x")
    assert set(path.read_text().splitlines()) == {whole}
    assert path.read_bytes().endswith(b"\n")


def test_table_escapes_spreadsheet_formulas(tmp_path):
    results = Results(tmp_path / "r.jsonl", tmp_path / "r.csv")
    results.add(result("=HYPERLINK(1)", failed=["b1", "b2"], verdict="FAIL"))
    results.write_table()
    assert "'=HYPERLINK(1),1,FAIL" in (tmp_path / "r.csv").read_text()
    assert "b1; b2" in (tmp_path / "r.csv").read_text()


@pytest.mark.parametrize(
    ("command", "fault"),
    [
        ("true", ""),
        ("sh -c 'echo no paper >&2; exit 3'", "it ended with 3: no paper"),
        ("sleep 20", "it took longer than 0.2 s and was ended"),
    ],
)
def test_result_of_command_is_reported(command, fault):
    assert Hook(command).run("{}", bound_s=0.2 if "sleep" in command else 30.0) == fault


def test_impossible_command_is_refused_at_once():
    for command in ("", "'", "/no/such/program x"):
        with pytest.raises(InputError, match="--on-result"):
            Hook(command)


def test_counts_use_last_verdict_of_each_unit():
    results = [
        result("A", 1, "FAIL", failed=["b1"]),
        result("A", 2, "PASS"),
        result("B", 1, "UNDECIDED", reasons=["not measured: no answer"]),
        result("C", 1, "PASS"),
    ]
    text = "\n".join(tally_lines(results))
    assert "3 units: 2 PASS, 1 UNDECIDED; 1 retests" in text
    assert "yield 2/3 (67 %), at the first attempt 1/3 (33 %)" in text
    assert "by: not measured: no answer 1" in text


def test_unjudged_unit_does_not_count_for_yield():
    results = [result("A"), result("B", verdict="MEASURED"), result("B", 2, "FAIL", failed=["b1"])]
    text = "\n".join(tally_lines(results))
    assert "2 units: 1 PASS, 1 FAIL; 1 retests" in text
    assert "yield 1/2 (50 %), at the first attempt 1/1 (100 %)" in text


def test_invalid_start_drives_nothing(tmp_path, monkeypatch, capsys):
    from tui import cli

    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"SN1\n")))
    monkeypatch.chdir(tmp_path)
    for words, text in [
        (["--recipe", "edss"], "--instrument is missing"),
        (["--recipe", "nothing"], "recipe 'nothing' was not found"),
        (["--recipe", "adss", "--instrument", "GPIB0::11::INSTR"], "give --yes"),
        (["--recipe", "adss", "--instrument", "sim:", "--out", "none/x"], "no directory"),
        (["--recipe", "adss", "--instrument", "sim:", "--judge", "adss"], "sets no limit"),
    ]:
        assert cli.main(["line", "--db", "bench.db", *words]) == 2
        out, err = capsys.readouterr()
        assert (out, err.count("\n"), text in err) == ("", 1, True)
    assert not (tmp_path / "bench.db").exists()

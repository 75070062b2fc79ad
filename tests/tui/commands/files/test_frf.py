"""``lashbench frf``: records of a servo whose response is known become responses that hold it."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.io import savemat, wavfile

sys.path.insert(0, str(Path(__file__).parents[3]))
from worlds import time_records as known

from analysis.resonance import extract
from analysis.time_records.response import response_of_record
from daq.errors import LashbenchError
from daq.formats import read_response
from daq.frf import DB_PER_NEPER
from daq.time_records.columns import read_record
from daq.time_records.record import TimeRecord
from tui.cli import main

FREQUENCIES = np.arange(22.0, 108.0, 2.0)
SIGNALS = {
    "a stepped sine": lambda rng: known.stepped(FREQUENCIES, (0.5, 2.0)),
    "a sweep": lambda rng: known.swept(),
    "a periodic signal": lambda rng: known.multisine(),
    "noise": lambda rng: known.noise(rng, 60.0),
}


def record(words, seed=0, noise=0.02, input_noise=0.0):
    rng = np.random.default_rng(seed)
    return TimeRecord(
        known.RATE, *known.driven(SIGNALS[words](rng), rng, noise=noise, input_noise=input_noise)
    )


def short_record():
    """For what is refused or not by its columns and options alone."""
    rng = np.random.default_rng(0)
    return TimeRecord(known.RATE, *known.driven(known.multisine(4, 1.0), rng, noise=0.02))


def off(response):
    """Readings off the truth, in their standard errors, shape (2, points)."""
    share = response.gain / known.truth(response.frequency_hz) - 1
    return np.stack(
        [
            share.real / (response.gain_std_db / DB_PER_NEPER),
            share.imag / np.radians(response.phase_std_deg),
        ]
    )


@pytest.mark.parametrize("words", SIGNALS)
def test_signal_kind_is_detected_errors_cover_truth(words):
    held = []
    for seed in range(3):
        response, notes = response_of_record(
            record(words, seed), unit="X", start_hz=20.0, stop_hz=110.0
        )
        assert response.provenance["excitation"] == words
        assert any(words in note for note in notes)
        held.append(np.abs(off(response)) < 1.96)
    share = np.mean(np.concatenate(held, axis=1))
    assert 0.90 < share < 0.99
    level = extract(response)[-1]
    exact = np.linspace(35, 75, 40_001)
    gain = np.abs(known.truth(exact))
    low, high = exact[np.argmin(gain)], exact[np.argmax(gain)]
    assert level.arf.frequency_hz == pytest.approx(low, abs=4 * level.arf.std_hz)
    assert level.rf.frequency_hz == pytest.approx(high, abs=4 * level.rf.std_hz)


def test_stepped_sine_is_split_into_dwells():
    """One point for each dwell and level."""
    response, _ = response_of_record(
        record("a stepped sine"), unit="X", settle_cycles=25, integrate_cycles=20
    )
    assert len(response) == 2 * FREQUENCIES.size
    np.testing.assert_allclose(response.levels_vpk, (0.5, 2.0), rtol=5e-3)
    for level in response.levels_vpk:
        np.testing.assert_allclose(response.at_level(level).frequency_hz, FREQUENCIES, rtol=1e-3)
    assert (response.direction, response.settle_cycles, response.integrate_cycles) == ("up", 25, 20)
    # The same noise at four times the level: a fourth of the error.
    low, high = (np.median(response.at_level(v).gain_std_db) for v in response.levels_vpk)
    assert low / high == pytest.approx(4.0, rel=0.3)


def test_unsettled_dwell_has_wide_errors():
    signal = known.stepped([69.0, 69.6, 70.2], cycles=14)
    rng = np.random.default_rng(0)
    response, notes = response_of_record(
        TimeRecord(known.RATE, *known.driven(signal, rng, noise=1e-5)), unit="X",
        excitation="stepped", settle_cycles=0,
    )  # fmt: skip
    assert any("settles" in note for note in notes)
    assert np.all(np.abs(off(response)) < 4.0)
    assert np.all(response.gain_std_db > 0.02)


@pytest.mark.parametrize(("estimator", "right"), [("H1", False), ("H2", True)])
def test_h2_is_right_with_input_noise(estimator, right):
    rng = np.random.default_rng(1)
    x, y = known.driven(known.noise(rng, 120.0), rng, input_noise=0.5)
    response, _ = response_of_record(
        TimeRecord(known.RATE, x, y), unit="X", estimator=estimator, start_hz=50.0, stop_hz=90.0
    )
    ratio = np.median(np.abs(response.gain / known.truth(response.frequency_hz)))
    assert (abs(ratio - 1) < 0.02) == right
    if not right:
        assert ratio == pytest.approx(1 / 1.25, rel=0.03)


def test_hv_lies_between_h1_and_h2():
    one = record("noise", noise=0.3, input_noise=0.3)
    found = [
        np.abs(response_of_record(one, unit="X", estimator=name, start_hz=30.0)[0].gain)
        for name in ("H1", "Hv", "H2")
    ]
    assert np.all(found[0] <= found[1])
    assert np.all(found[1] <= found[2])


def written(folder, kind, one):
    path = folder / f"record.{kind}"
    if kind == "csv":
        rows = np.column_stack([np.arange(len(one)) / one.rate_hz, one.input_v, one.output_v])
        np.savetxt(path, rows, delimiter=",", header="time (s),V_i (V),V_o (V)", comments="")
        return path, ["--input", "V_i", "--output", "V_o", "--time", "time"]
    if kind == "mat":
        savemat(path, {"data": np.column_stack([one.input_v, one.output_v]), "fs": one.rate_hz})
        return path, ["--input", "data(:,1)", "--output", "2", "--rate", "1000"]
    top = max(np.abs(one.input_v).max(), np.abs(one.output_v).max())
    both = np.column_stack([one.input_v, one.output_v]) / top
    wavfile.write(path, round(one.rate_hz), np.round(both * 32767).astype(np.int16))
    scale = str(top * 32768 / 32767)
    return path, ["--input", "1", "--output", "2", "--input-scale", scale, "--output-scale", scale]


@pytest.mark.parametrize("kind", ["csv", "mat", "wav"])
def test_written_response_is_read_by_other_verbs(kind, tmp_path, capsys):
    path, words = written(tmp_path, kind, record("a periodic signal"))
    out = tmp_path / "response.csv"
    assert main(["frf", str(path), *words, "--out", str(out), "--unit-name", "ADSS"]) == 0
    told = capsys.readouterr()
    assert told.out == ""
    assert "a periodic signal" in told.err
    response = read_response(out)
    assert response.unit == "ADSS"
    assert "excitation" in out.read_text()
    assert np.mean(np.abs(off(response)) < 1.96) > 0.88
    assert np.all(np.isfinite(response.source_vpk))
    assert main(["extract", str(out)]) == 0
    assert re.search(r"ARF +39\.", capsys.readouterr().out)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (["--input", "nothing"], "no column 'nothing'"),
        (["--rate", "0"], "no sampling rate"),
        (["--rate", "2000"], "column time 1000 Hz"),
        (["--estimator", "H2"], "H2 is for noise"),
        (["--settle-cycles", "3"], "stepped sine"),
        (["--start", "600", "--stop", "700"], "nothing of it between"),
        (["--start", "60", "--stop", "50"], "not below"),
        (["--out", "somewhere.xyz"], "xyz"),
        (["--input-scale", "0"], "no scale"),
    ],
)
def test_inconsistent_options_are_refused_in_one_line(change, said, tmp_path, capsys):
    path, words = written(tmp_path, "csv", short_record())
    out = tmp_path / "out.csv"
    for option, value in zip(change[::2], change[1::2], strict=True):
        if option in words:
            words[words.index(option) + 1] = value
        elif option == "--out":
            out = tmp_path / value
        else:
            words += [option, value]
    assert main(["frf", str(path), *words, "--out", str(out)]) in (1, 2)
    told = capsys.readouterr()
    assert said in told.err
    assert told.err.count("\n") <= 2
    assert not out.exists()


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        (["--input", "V_i", "--output", "v_i (V)"], "the same column"),
        (["--input", "2", "--output", "V_i"], "the same column"),
        (["--input", "time", "--output", "V_o"], "the input rises"),
        (["--input", "V_i", "--output", "1"], "the output rises"),
    ],
)
def test_columns_without_record_are_refused(columns, said, tmp_path, capsys):
    path, _ = written(tmp_path, "csv", short_record())
    out = tmp_path / "out.csv"
    assert main(["frf", str(path), *columns, "--time", "time", "--out", str(out)]) == 2
    assert said in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize(
    ("header", "scale", "rate", "refused"),
    [
        ("time (s),V_i,V_o", 1.0, "500", True),
        ("t,V_i,V_o", 1.0, "1020", True),
        ("Time_ms,V_i,V_o", 1e3, "2000", True),
        (None, 1.0, "500", True),
        # In milliseconds; a number of the sample; no column of times at all.
        ("Time_ms,V_i,V_o", 1e3, "1000", False),
        ("t,V_i,V_o", 1.0, "1000", False),
        (None, 1e3, "500", False),
        ("n,V_i,V_o", 1e3, "500", False),
        ("angle,V_i,V_o", 0.3, "500", False),
    ],
)
def test_rate_contradicting_time_column_is_refused(header, scale, rate, refused, tmp_path, capsys):
    one = short_record()
    path, out = tmp_path / "record.csv", tmp_path / "out.csv"
    rows = np.column_stack([np.arange(len(one)) / one.rate_hz * scale, one.input_v, one.output_v])
    np.savetxt(path, rows, delimiter=",", header=header or "", comments="")
    words = ["frf", str(path), "--input", "2", "--output", "3", "--rate", rate, "--out", str(out)]
    assert main(words) == (2 if refused else 0)
    said = capsys.readouterr().err
    assert out.exists() != refused
    if refused:
        assert f"--rate says {rate} Hz" in said
        assert f"{1000 / scale:g} Hz" in said


@pytest.mark.parametrize("words", SIGNALS)
@pytest.mark.parametrize("noise", [0.02, 40.0])
def test_output_incoherent_with_input_has_warning(words, noise):
    one = record(words, noise=noise)
    _, notes = response_of_record(one, unit="X", start_hz=20.0, stop_hz=110.0)
    assert any(note.startswith("warning") for note in notes) == (noise > 1.0)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda text: text.replace("0.005", "nan", 1) and "a,b\n1,2\n3,4\n", "holds 2 samples"),
        (lambda text: "V_i,V_o\n" + "1.0,2.0\n" * 100, "constant"),
        (lambda text: "V_i,V_o\n" + "".join(f"{k % 7},\n" for k in range(100)), "table|row|lacks"),
        (lambda text: "V_i,V_o\n1,2\nwhat,3\n" * 50, "row"),
        (lambda text: "", "empty"),
        (lambda text: "\x00\x01\x02" * 50, "not text"),
    ],
)
def test_a_spoilt_record_is_refused(spoil, said, tmp_path):
    path = tmp_path / "record.csv"
    path.write_text(spoil("0.005"))
    with pytest.raises(LashbenchError, match=said):
        read_record(path, "1", "2", rate_hz=1000.0)


def test_short_or_empty_wav_file_is_refused(tmp_path):
    path, _ = written(tmp_path, "wav", record("a periodic signal"))
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(LashbenchError, match="cannot be read as a WAV file"):
        read_record(path, "1", "2")
    wavfile.write(path, 1000, np.empty((0, 2), np.int16))
    with pytest.raises(LashbenchError, match="holds no samples"):
        read_record(path, "1", "2")


def test_uneven_times_are_refused_unless_rounded(tmp_path):
    t = np.arange(2000) / 1024.0
    x = np.sin(2 * np.pi * 40 * t)
    path = tmp_path / "record.csv"
    np.savetxt(
        path, np.column_stack([np.round(t, 5), x, x]), delimiter=",", header="t,a,b", comments=""
    )
    assert read_record(path, "a", "b", time_column="t").rate_hz == pytest.approx(1024, rel=1e-4)
    t[700:] += 0.01
    np.savetxt(path, np.column_stack([t, x, x]), delimiter=",", header="t,a,b", comments="")
    with pytest.raises(LashbenchError, match=r"step after time 0\.68"):
        read_record(path, "a", "b", time_column="t")


@settings(deadline=None, max_examples=20)
@example(seed=194061, size=64, kind="sine")  # at half the sampling rate
@given(
    st.integers(0, 2**31), st.integers(64, 3000),
    st.sampled_from(["noise", "sine", "square", "ramp", "steps", "tiny", "huge"]),
)  # fmt: skip
def test_any_record_gives_finite_response_or_error(seed, size, kind):
    rng = np.random.default_rng(seed)
    t = np.arange(size) / 100.0
    f = rng.uniform(0.1, 49.0)
    x = {
        "noise": rng.normal(size=size),
        "sine": np.sin(2 * np.pi * f * t),
        "square": np.sign(np.sin(2 * np.pi * f * t) + 1e-3),
        "ramp": t,
        "steps": np.floor(t * f) % 3,
        "tiny": 1e-300 * rng.normal(size=size),
        "huge": 1e11 * rng.normal(size=size),
    }[kind]
    try:
        response, _ = response_of_record(
            TimeRecord(100.0, x, np.roll(x, 1) + 1e-3 * rng.normal(size=size)), unit="X"
        )
    except LashbenchError:
        return
    assert np.all(np.isfinite(response.gain))
    assert np.all(response.gain_std_db > 0)
    assert np.all(np.isfinite(response.phase_std_deg))


def test_a_damaged_mat_file_is_one_line(tmp_path):
    path = tmp_path / "record.mat"
    path.write_bytes((Path(__file__).parents[3] / "data" / "crash.mat").read_bytes())
    done = subprocess.run(
        [sys.executable, "-m", "tui.cli", "frf", str(path), "--input", "1", "--output", "2",
         "--rate", "1000", "--out", str(tmp_path / "out.csv")],
        capture_output=True, text=True, cwd=Path(__file__).parents[4], check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "cannot be read" in done.stderr

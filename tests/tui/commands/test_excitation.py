"""A response of a signal that nobody states is refused early; one that is stated is compared."""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))
from worlds import time_records as known

from analysis.diagnosis import diagnose_response
from analysis.estimate import estimate_response
from analysis.observation.observation import observe
from analysis.time_records.response import response_of_record
from daq.errors import InputError
from daq.excitation.signal import excitation_of
from daq.formats import read_response, write_response
from daq.time_records.record import TimeRecord
from sim.unit import load_unit
from tui.cli import main

SIGNALS = {
    "a sweep": lambda rng: known.swept(),
    "a periodic signal": lambda rng: known.multisine(),
    "noise": lambda rng: known.noise(rng, 60.0),
}


def response_to(words, stated=False):
    rng = np.random.default_rng(0)
    record = TimeRecord(known.RATE, *known.driven(SIGNALS[words](rng), rng, noise=0.02))
    response = response_of_record(record, unit="ADSS", start_hz=20.0, stop_hz=110.0)[0]
    if stated:
        return response
    known_of_it = {k: v for k, v in response.provenance.items() if k != "excitation_signal"}
    return replace(response, provenance=known_of_it)


@pytest.mark.parametrize(
    ("words", "kind"),
    [
        # Each signal and each format once; `make long` takes all combinations.
        pytest.param(words, kind, marks=[pytest.mark.long] * (i != j % len(SIGNALS)))
        for i, words in enumerate(SIGNALS)
        for j, kind in enumerate(("csv", "h5", "uff", "mat"))
    ],
)
def test_file_formats_preserve_refused_excitation(words, kind, tmp_path):
    path = tmp_path / f"r.{kind}"
    write_response(response_to(words), path)
    for answer in (estimate_response, diagnose_response):
        with pytest.raises(InputError, match=f"from {words}, not from a stepped sine"):
            answer(read_response(path), load_unit("adss"))


@pytest.mark.parametrize(
    "words", ["a periodic signal", pytest.param("noise", marks=pytest.mark.long)]
)
@pytest.mark.parametrize("kind", ["csv", "h5", "uff", "mat"])
def test_every_file_keeps_the_signal(words, kind, tmp_path):
    path, made = tmp_path / f"r.{kind}", response_to(words, stated=True)
    write_response(made, path)
    kept = read_response(path)
    assert excitation_of(kept.provenance) == excitation_of(made.provenance)
    ((plan, rows),) = observe(kept).plans
    assert plan.excitation == excitation_of(made.provenance)
    assert len(rows) == len(made)


@pytest.mark.parametrize("words", ["a periodic signal", "noise"])
def test_diagnosis_of_stated_signal_is_refused(words, tmp_path, capsys):
    path = tmp_path / "r.csv"
    write_response(response_to(words, stated=True), path)
    assert main(["diagnose", str(path), "--unit", "adss", "--as-is"]) == 2
    told = capsys.readouterr()
    assert not told.out
    (error,) = [line for line in told.err.splitlines() if line.startswith("error")]
    assert words in error
    assert "`estimate`" in error


@pytest.mark.parametrize(
    ("key", "value"),
    [("period_s", -1.0), ("lines", [3, 2]), ("kind", "music"), ("phase_deg", [0.0])],
)
def test_impossible_signal_is_refused_by_key(key, value, tmp_path, capsys):
    made = response_to("a periodic signal", stated=True)
    signal = dict(made.provenance["excitation_signal"]) | {key: value}
    path = tmp_path / "r.csv"
    write_response(
        replace(made, provenance=dict(made.provenance) | {"excitation_signal": signal}), path
    )
    assert main(["estimate", str(path), "--unit", "adss"]) == 2
    (error,) = [x for x in capsys.readouterr().err.splitlines() if x.startswith("error")]
    assert key in error


@pytest.mark.parametrize("verb", ["estimate", "diagnose"])
@pytest.mark.parametrize("more", [[], ["--as-is"]])
def test_verbs_refuse_excitation_at_once(verb, more, tmp_path, capsys):
    path = tmp_path / "r.csv"
    write_response(response_to("noise"), path)
    began_s = time.process_time()
    assert main([verb, str(path), "--unit", "adss", *more]) == 2
    assert time.process_time() - began_s < 10.0
    told = capsys.readouterr()
    assert not told.out
    (error,) = [line for line in told.err.splitlines() if line.startswith("error")]
    assert "noise" in error
    assert "stepped sine" in error
    assert "phase" not in error


@pytest.mark.parametrize("more", [[], ["--as-is"]])
def test_report_omits_estimate_of_refused_excitation(more, tmp_path):
    path, out = tmp_path / "r.csv", tmp_path / "r.html"
    write_response(response_to("noise"), path)
    assert main(["report", str(path), "--unit", "adss", "--out", str(out), *more]) == 0
    text = out.read_text()
    assert "No estimate was made" in text
    assert "not from a stepped sine" in text
    assert "--as-is" not in text


@pytest.mark.parametrize("said", ["a stepped sine", "Swept Sine", "", None])
def test_stepped_or_unstated_excitation_is_accepted(said, tmp_path, capsys):
    """What else there is to say of it is said: it is no response of the unit."""
    path = tmp_path / "r.csv"
    write_response(response_to("noise"), path)
    text = path.read_text()
    line = "" if said is None else f'# excitation = "{said}"\n'
    path.write_text(text.replace('# excitation = "noise"\n', line))
    assert "noise" not in path.read_text().partition("frequency_hz,")[0].replace("noises", "")
    assert main(["estimate", str(path), "--unit", "adss"]) in (1, 2)
    assert "not from a stepped sine" not in capsys.readouterr().err

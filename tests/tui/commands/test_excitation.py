"""A response that was not measured with a stepped sine is refused early."""

import sys
import time
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))
from worlds import time_records as known

from analysis.diagnosis import diagnose_response
from analysis.estimate import estimate_response
from analysis.time_records.response import response_of_record
from daq.errors import InputError
from daq.formats import read_response, write_response
from daq.time_records.record import TimeRecord
from sim.unit import load_unit
from tui.cli import main

SIGNALS = {
    "a sweep": lambda rng: known.swept(),
    "a periodic signal": lambda rng: known.multisine(),
    "noise": lambda rng: known.noise(rng, 60.0),
}


def response_to(words):
    rng = np.random.default_rng(0)
    record = TimeRecord(known.RATE, *known.driven(SIGNALS[words](rng), rng, noise=0.02))
    return response_of_record(record, unit="ADSS", start_hz=20.0, stop_hz=110.0)[0]


@pytest.mark.parametrize("words", SIGNALS)
@pytest.mark.parametrize("kind", ["csv", "h5", "uff", "mat"])
def test_file_formats_preserve_refused_excitation(words, kind, tmp_path):
    path = tmp_path / f"r.{kind}"
    write_response(response_to(words), path)
    for answer in (estimate_response, diagnose_response):
        with pytest.raises(InputError, match=f"from {words}, not from a stepped sine"):
            answer(read_response(path), load_unit("adss"))


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

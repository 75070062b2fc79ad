"""Usual mistakes in a response are named before anything is simulated; true responses pass."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.observation.input_check import MISTAKES, check_input, check_inputs
from daq.errors import AnalysisError, InputError
from daq.formats import read_response, write_response
from daq.frf import FrequencyResponse
from sim.engine.effort import counting
from sim.unit import load_unit
from tui.cli import main

PRACTICE = Path(__file__).parents[2] / "data" / "practice"
SETS = sorted(PRACTICE.glob("*.csv"))


def turned(response, sign=1.0, degrees=0.0):
    phase = np.radians(sign * response.phase_deg + degrees)
    return replace(response, gain=np.abs(response.gain) * np.exp(1j * phase))


def times(response, factor):
    return replace(response, gain=response.gain * factor)


def swung(response):
    return 2j * np.pi * response.frequency_hz


MADE = {
    "phase in radians": lambda r: replace(
        r, gain=np.abs(r.gain) * np.exp(1j * np.radians(np.angle(r.gain)))
    ),
    "conjugate": lambda r: turned(r, -1.0),
    "inverted": lambda r: turned(r, degrees=180.0),
    "swapped": lambda r: replace(r, gain=1.0 / r.gain),
    "linear gain": lambda r: replace(
        r, gain=10 ** (np.abs(r.gain) / 20.0) * r.gain / np.abs(r.gain)
    ),
    "decibels as gain": lambda r: times(r, np.abs(20 * np.log10(np.abs(r.gain))) / np.abs(r.gain)),
    "rad/s": lambda r: replace(r, frequency_hz=2.0 * np.pi * r.frequency_hz),
    "position": lambda r: times(r, 1000.0 / swung(r)),
    "acceleration": lambda r: times(r, swung(r)),
    "gain factor": lambda r: times(r, 10.0),
}
"""How each mistake is made of a true response."""


def test_every_mistake_of_the_table_is_tried():
    assert set(MADE) == set(MISTAKES)


@pytest.mark.parametrize(
    "path",
    [pytest.param(one, marks=[pytest.mark.long] * (n % 4 > 0)) for n, one in enumerate(SETS)],
    ids=[one.stem for one in SETS],
)
def test_true_response_passes_despite_hidden_cause(path):
    response = read_response(path)
    found = check_input(response, load_unit(response.unit))
    assert (found.mistake, found.foreign, found.words) == (None, False, "")


@pytest.mark.parametrize(
    ("name", "mistake"),
    [("practice-03", mistake) for mistake in MADE]
    + [("practice-10", "conjugate")]
    + [
        pytest.param("practice-10", mistake, marks=pytest.mark.long)
        for mistake in ("inverted", "linear gain", "rad/s")
    ],
)
def test_mistake_is_named_with_remedy_before_simulation(name, mistake):
    true = read_response(PRACTICE / f"{name}.csv")
    unit = load_unit(true.unit)
    with counting() as effort, pytest.raises(InputError) as told:
        check_inputs([MADE[mistake](true)], unit)
    assert effort.simulated_s == 0.0
    assert MISTAKES[mistake].words.split("{")[0] in str(told.value)
    assert "--as-is" in str(told.value)


def test_as_is_says_what_was_refused():
    inverted = MADE["inverted"](read_response(PRACTICE / "practice-03.csv"))
    unit = load_unit(inverted.unit)
    with pytest.raises(InputError) as told:
        check_inputs([inverted], unit)
    (said,) = check_inputs([inverted], unit, as_is=True)
    assert said in str(told.value)


def test_offset_of_gain_is_stated():
    true = read_response(SETS[0])
    found = check_input(times(true, 10.0), load_unit("adss"))
    shown = float(found.words.split("off by ")[1].split(" dB")[0])
    assert abs(shown - 20.0) < 6.0


def noise(seed=0, rows=61):
    rng = np.random.default_rng(seed)
    gain = 0.1 * np.exp(rng.normal(size=rows) + 1j * rng.uniform(-np.pi, np.pi, rows))
    return FrequencyResponse.from_arrays(np.linspace(100, 180, rows), 2.5, gain, unit="ADSS")


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(n, marks=pytest.mark.long) for n in range(1, 5))]
)
def test_noise_is_no_response_of_the_unit(seed):
    for unit in ("adss", "edss"):
        assert check_input(noise(seed), load_unit(unit)).foreign


def test_constant_is_no_response_of_unit():
    for gain in (1.0, 0.05, 0.05 + 0.02j, 10.0):
        constant = replace(noise(), gain=np.full(61, gain, dtype=complex))
        with pytest.raises(AnalysisError, match="no response of unit ADSS"):
            check_inputs([constant], load_unit("adss"))


def test_too_few_rows_are_not_judged():
    assert check_input(noise(rows=7), load_unit("adss")).words == ""


def test_missing_phase_limits_checks_to_gain():
    true = read_response(SETS[2])
    lacking = replace(true, phase_known=np.zeros(len(true), dtype=bool), gain=np.abs(true.gain))
    assert check_input(lacking, load_unit("adss")).words == ""
    assert check_input(replace(lacking, gain=1.0 / lacking.gain), load_unit("adss")).mistake


@pytest.mark.parametrize("verb", ["estimate", "diagnose"])
def test_verbs_refuse_mistake_in_one_line(verb, tmp_path, capsys):
    path = tmp_path / "sweep.csv"
    write_response(MADE["phase in radians"](read_response(SETS[0])), path)
    assert main([verb, str(path), "--unit", "adss", "--json"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    (line,) = [text for text in err.splitlines() if text.startswith("error:")]
    assert line.startswith("error: the phase is likely in radians; multiply phase_deg by 57.29578")
    write_response(noise(), path)
    assert main([verb, str(path), "--unit", "adss", "--json"]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert "error: this is no response of unit ADSS" in err


def test_as_is_estimates_and_warns_first(tmp_path, capsys):
    path = tmp_path / "sweep.csv"
    true = read_response(SETS[0])
    few = MADE["inverted"](true.take(np.arange(0, 61, 6)))
    write_response(replace(few, settle_cycles=2, integrate_cycles=3), path)
    assert main(["estimate", str(path), "--unit", "adss", "--as-is", "--json"]) == 0
    warnings = json.loads(capsys.readouterr().out)["warnings"]
    assert warnings[0].startswith("one channel is likely inverted")

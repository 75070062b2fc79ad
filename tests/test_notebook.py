"""The names for a notebook: what they load, how results show themselves, and the example."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from instruments.bench_server import linear_analyser, served
from outputs.executed_notebook import MOST_BYTES, NOTEBOOK, SCRIPT, parts

import lashbench as lb
from daq.analyser import SourceState
from daq.configs import config_path
from daq.errors import ConfigurationError, InputError, LashbenchError, LimitError
from daq.frf import FrequencyResponse
from daq.plan import SweepPlan
from daq.store import Store

ROOT = Path(__file__).parents[1]


def test_heavy_libraries_load_only_on_use():
    program = "import sys, lashbench as lb; print([n for n in lb.__all__ if not hasattr(lb, n)]);"
    program += "print({'numpy', 'scipy', 'matplotlib', 'textual', 'cyclopts'} & set(sys.modules));"
    # Its distributions took two thirds of what reading features loads.
    program += "import analysis.resonance, analysis.diagnosis; print('scipy.stats' in sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert run.stdout == "[]\nset()\nFalse\n"


def test_a_result_is_shown_escaped():
    response = FrequencyResponse.from_arrays(
        [100.0, 110.0], 1.0, [1j, 2j], unit="<script>\x1b[2J</script>"
    )
    shown = lb.Result("read", response, response)
    assert "<script" not in shown._repr_html_()
    assert "\x1b" not in repr(shown)
    assert "2 points, 100 to 110 Hz at 1 V peak" in repr(shown)
    assert shown.unit == response.unit
    assert len(shown.plot().axes) == 2


def test_sweep_is_stored_with_source_off(tmp_path, capsys):
    plan = SweepPlan((130.0, 150.0), (2.5,), settle_cycles=2, integrate_cycles=3)
    measured = lb.measure(plan, "adss", "sim:?ratio=0.3&seed=1", db=tmp_path / "lab.db")
    assert capsys.readouterr().out == ""
    assert len(measured) == 2
    with Store(tmp_path / "lab.db", read_only=True) as store:
        kept = store.measurement(1)
    assert (kept.state, kept.source_state) == ("complete", SourceState.CONFIRMED_OFF)
    # With the files of unit and bench, as any other measurement.
    assert 'name = "ADSS"' in kept.header.configurations["unit"]
    assert "[limits]" in kept.header.configurations["bench"]


def test_hardware_is_driven_only_with_yes(tmp_path):
    plan = SweepPlan((130.0,), (2.5,))
    with pytest.raises(InputError, match="yes=True"):
        lb.measure(plan, "adss", "GPIB0::11::INSTR", db=tmp_path / "lab.db")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("instrument", ["sim:", "simulated:", "SIM:"])
def test_impossible_sweep_is_refused_without_history(tmp_path, instrument):
    """By a bench of one's own, by the instrument, and by what is no address."""
    narrow = tmp_path / "narrow.toml"
    text = config_path("benches", "default").read_text(encoding="utf-8")
    narrow.write_text(re.sub(r"(?m)^source_vpk = .*$", "source_vpk = 0.5", text), encoding="utf-8")
    plan = SweepPlan((130.0,), (2.5,))
    with pytest.raises((LimitError, ConfigurationError)):
        lb.measure(plan, "adss", instrument, db=tmp_path / "lab.db", bench=str(narrow))
    assert not (tmp_path / "lab.db").exists()


def test_fault_states_stored_points_and_source_off(tmp_path):
    frequencies = tuple(float(hz) for hz in range(130, 160))
    plan = SweepPlan(frequencies, (2.5,), settle_cycles=2, integrate_cycles=3)
    with (
        served(
            linear_analyser(lambda hz: 0.5 + 0.1j, faults=["hardware-error:point=4"])
        ) as address,
        pytest.raises(LashbenchError, match=r"\d points? kept, source confirmed off"),
    ):
        lb.measure(plan, "adss", address, db=tmp_path / "lab.db", yes=True)


def test_notebook_is_the_script_with_outputs():
    """Where this fails, ``make notebook`` executes it anew."""
    text = NOTEBOOK.read_text(encoding="utf-8")
    assert len(text.encode()) <= MOST_BYTES
    document = json.loads(text)
    cells = [cell for cell in document["cells"] if cell["cell_type"] == "code"]
    _, sections = parts(SCRIPT.read_text(encoding="utf-8"))
    assert ["".join(cell["source"]) for cell in cells] == [code for _, code in sections]
    words = [one["source"] for one in document["cells"] if one["cell_type"] == "markdown"]
    headings = ["".join(one) for one in words]
    assert headings[1:] == [heading for heading, _ in sections]
    pictures = 0
    for cell in cells:
        assert cell["outputs"], cell["source"]
        assert all(one["output_type"] != "error" for one in cell["outputs"])
        pictures += sum("image/png" in one.get("data", ()) for one in cell["outputs"])
    assert pictures == 2
    said = "".join(
        line for cell in cells for one in cell["outputs"] for line in one.get("text", ())
    )
    assert "183 points, 100 to 180 Hz" in said
    assert "contribution ratio" in said


def test_ratio_without_unit_is_refused():
    response = FrequencyResponse.from_arrays([100.0, 110.0], 1.0, [1j, 2j], unit="ADSS")
    with pytest.raises(InputError, match="give the unit"):
        lb.plot(response, ratio=0.3)

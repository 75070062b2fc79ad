"""The verb plot: files and stored measurements as pictures, and what it refuses."""

import pytest

from analysis.edition import EDITION
from daq.analyser import SourceState, SweepPoint
from daq.configs import config_path, sample_path
from daq.plan import SweepPlan
from daq.store import Store
from daq.store_records import MeasurementHeader
from sim.unit import load_unit
from tui import cli
from tui.measurements.stored_answers import belief_of, software

SAMPLE = str(sample_path("adss-sweep"))
SHORT = '# unit = "ADSS"\n# settle_cycles = 3\n# integrate_cycles = 4\n'
SHORT += "frequency_hz,source_vpk,gain_db,phase_deg,gain_std_db\n"
SHORT += "".join(f"{f},{v},-10,-170,0.5\n" for v in (1.5, 2.5) for f in (130, 140, 150))


@pytest.fixture
def short(tmp_path):
    path = tmp_path / "short.csv"
    path.write_text(SHORT)
    return path


@pytest.fixture
def db(tmp_path):
    path = tmp_path / "bench.db"
    plan = SweepPlan((130.0, 150.0), (1.5,), settle_cycles=3, integrate_cycles=4)
    texts = {"unit": config_path("units", "adss").read_text(encoding="utf-8")}
    with Store(path, create=True) as store:
        number = store.begin(
            MeasurementHeader("ADSS", "SN 7", plan, "sim:", "test", configurations=texts)
        )
        for hz in plan.frequencies_hz:
            store.add_point(number, 1.5, hz, SweepPoint(hz, 0.3 - 0.1j))
        store.finish(number, "complete", SourceState.CONFIRMED_OFF)
    return path


def keep(db, ratio):
    with Store(db) as store:
        version = store.measurement(1).points_version
        document = {"contribution_ratio": ratio, "b1_deg": ratio, "b2_deg": ratio,
                    "b_t_deg": ratio, "warnings": [], "refuted": False}  # fmt: skip
        store.add_estimate(
            1, software(), document, points_version=version,
            physics=belief_of(load_unit("adss")), edition=EDITION,
        )  # fmt: skip


@pytest.mark.parametrize(
    ("suffix", "head"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("PDF", b"%PDF")]
)
def test_files_and_identifiers_in_one_picture(run, db, short, tmp_path, suffix, head):
    out = tmp_path / f"picture.{suffix}"
    code, told, _ = run("plot", short, "1", "--out", out)
    assert (code, told) == (0, "")
    first = out.read_bytes()
    assert first.startswith(head)
    if suffix == "svg":
        assert run("plot", short, "1", "--out", out)[0] == 0
        assert out.read_bytes() == first


def test_model_or_stored_answer_is_drawn_beside(run, db, short, tmp_path):
    """A model is drawn beside a file, the stored answer beside an identifier."""
    bare, beside = tmp_path / "bare.svg", tmp_path / "beside.svg"
    assert run("plot", short, "--out", bare, history=False)[0] == 0
    words = ["--model", "--unit", "adss", "--ratio", "0.3"]
    code, _, err = run("plot", short, *words, "--out", beside, history=False)
    assert code == 0, err
    assert "r = 0.300" in err
    assert len(beside.read_bytes()) > len(bare.read_bytes())
    code, _, err = run("plot", "1", "--model", "--out", beside)
    assert code == 0, err
    assert "ADSS, any r" in err
    assert "32 simulated units" in err
    assert "r anywhere from 0 to 1" in err
    keep(db, {"value": 0.41, "std": 0.02, "interval95": [0.37, 0.45]})
    code, _, err = run("plot", "1", "--model", "--out", beside)
    assert code == 0, err
    assert "ADSS, r = 0.410" in err
    assert "r = 0.410 +- 0.020 by the stored answer" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--out", "a.gif"], ".png, .svg, .pdf"),
        (["--out", "nosuffix"], "no suffix"),
        (["--ratio", "0.3", "--out", "a.png"], "--model"),
        (["--model", "--out", "a.png"], "needs --unit"),
        (["--model", "--unit", "adss", "--ratio", "1.5", "--out", "a.png"], "give 0 to 1"),
        (["--only-level", "9", "--out", "a.png"], "it has 1.5, 2.5"),
        (["gone.csv", "--out", "a.png"], "gone.csv"),
    ],
)
def test_refused_plot_leaves_no_picture(run, short, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    code, _, err = run("plot", short, *words, history=False)
    assert (code, err.count("\n")) == (2, 1)
    assert said in err
    assert {path.name for path in tmp_path.iterdir()} == {"bench.db", "short.csv"}


def test_no_input_is_overwritten(run, db, tmp_path):
    source = tmp_path / "data.png"
    source.write_text(SHORT)
    link = tmp_path / "link.svg"
    link.symlink_to(source)
    for out in (source, link):
        code, _, err = run("plot", source, "--out", out, history=False)
        assert code == 2
        assert "is the file that is read" in err
    assert source.read_text() == SHORT
    history = tmp_path / "history.pdf"
    before = db.read_bytes()
    db.rename(history)
    assert cli.main(["plot", "1", "--db", str(history), "--out", str(history)]) == 2
    assert history.read_bytes() == before

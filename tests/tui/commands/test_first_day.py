"""The first day, on simulated instruments, whole and broken: report, transcript, source off."""

import json
import re
import socket

import pytest
from instruments.bench_server import served, simulated
from instruments.fake_analyser import known_gain

from daq.drivers import DRIVERS
from sim.instrument.plant import LinearPlant
from tui import cli

CHECKED = [driver for driver in DRIVERS if driver.first_day is not None]


def first_day(url, folder, *words):
    return cli.main(["first-day", "--instrument", url, "--out", str(folder), *words])


@pytest.mark.parametrize("driver", CHECKED, ids=lambda driver: driver.scheme or "preset")
def test_all_checks_run_on_simulated_instruments(tmp_path, capsys, driver):
    url = f"{driver.scheme}:sim:?noise=0.00001".removeprefix(":")
    assert first_day(url, tmp_path / "one", "--json") == 0
    document = json.loads(capsys.readouterr().out)
    verdicts = {one["name"]: one["verdict"] for one in document["findings"]}
    assert list(verdicts) == [check.name for check in driver.first_day()]
    assert document["source_state"] == "confirmed-off"
    # What only a person sees stays open here; nothing of the rest is other than assumed.
    assert set(verdicts.values()) <= {"holds", "not looked at"}, document["findings"]
    assert sum(verdict == "holds" for verdict in verdicts.values()) > len(verdicts) / 2
    report = (tmp_path / "one" / "report.md").read_text()
    for check in driver.first_day():
        assert f"| {check.name} |" in report
        assert check.where in report
    acts = (tmp_path / "one" / "transcript.jsonl").read_text().splitlines()
    assert len(acts) > 100
    assert first_day(url, tmp_path / "one") == 2


@pytest.mark.slow
def test_difference_names_the_setting_to_change(tmp_path, capsys):
    box = simulated("sr785", LinearPlant(known_gain), noise_v=1e-4)
    # An instrument whose displays lose their data when another quantity is chosen.
    box.choices = type(box.choices)(
        **{name: getattr(box.choices, name) for name in type(box.choices).__slots__}
        | {"noise_v": 0.0, "converter_noise": 0.0, "data_survive_change": False}
    )
    with served(box, driver="sr785") as url:
        assert first_day(url, tmp_path, "--yes") == 0
    said = capsys.readouterr().out
    assert "differs         change of MEAS" in said


def test_lost_connection_ends_with_source_off(tmp_path, capsys):
    """A new connection switches the source off."""
    box = simulated("", LinearPlant(known_gain), ["dropped-connection:phase=prepare,skip=30"])
    with served(box) as url:
        assert first_day(url, tmp_path, "--yes") == 3
    assert "connection was lost" in capsys.readouterr().err
    assert box.driven_v == 0
    report = (tmp_path / "report.md").read_text()
    assert "- source in the end: confirmed-off" in report
    assert "- ended: early" in report


@pytest.mark.parametrize("made", ["", "in/two/"])
def test_missing_instrument_leaves_no_folder(tmp_path, capsys, made):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        url = f"TCPIP::127.0.0.1::{free.getsockname()[1]}::SOCKET"
        assert first_day(url, tmp_path / f"{made}out", "--yes") == 3
    assert "no connection" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_missing_option_ends_checks_without_driving(tmp_path, capsys):
    box = simulated("", LinearPlant(known_gain), ["missing-option"])
    with served(box) as url:
        assert first_day(url, tmp_path, "--yes") == 1
    assert "1D2" in capsys.readouterr().err
    assert box.points_begun == 0
    report = (tmp_path / "report.md").read_text()
    assert "0 holds" in report
    assert "- ended: early" in report


def test_no_check_exceeds_the_given_level(tmp_path):
    assert first_day("sim:?noise=0.00001", tmp_path, "--level", "0.004") == 0
    acts = (tmp_path / "transcript.jsonl").read_text().splitlines()
    lines = [json.loads(act).get("line", "") for act in acts]
    found = [re.fullmatch(r"SOUR:VOLT (\S+)( VPK)?", line) for line in lines]
    # A bare number may be taken as a root mean square.
    levels = [float(one[1]) * (1 if one[2] else 2**0.5) for one in found if one]
    assert 0.0 < max(levels) <= 0.004


@pytest.mark.parametrize(("words", "code"), [(("--level", "0"), 5), (("--level", "3"), 5), ((), 2)])
def test_nothing_is_sent_without_permission(tmp_path, words, code):
    box = simulated("", LinearPlant(known_gain))
    with served(box) as url:
        assert first_day(url, tmp_path / "out", *words) == code
    assert box.agenda.now_s < 1.0
    assert not (tmp_path / "out").exists()

"""The one table of drivers: nobody else names one."""

import ast
from pathlib import Path

import pytest
from instruments.bench_server import linear_analyser, served, simulated
from instruments.fake_analyser import known_gain

import daq
from daq.analyser import SourceState
from daq.drivers import (
    DRIVERS,
    check_sweep,
    driver_at,
    driver_for,
    load_all_of,
    open_analyser,
    parse_instrument,
)
from daq.errors import ConfigurationError, LimitError, LinkError
from daq.plan import SweepPlan
from sim.instrument.plant import LinearPlant
from sim.loopback import Loopback
from sim.models import models

ROOT = Path(daq.__file__).parents[1]
INSTRUMENTS = tuple(
    f"{place.parent.parent.name}.{place.parent.name}"
    for entry in ("daq/*/driver.py", "sim/*/model.py")
    for place in ROOT.glob(entry)
)
"""How modules of instruments begin."""


def imported(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{name.name}" for name in node.names)


def test_only_driver_tables_import_instruments():
    for floor in ("daq", "sim", "analysis", "tui"):
        for path in (ROOT / floor).rglob("*.py"):
            place = path.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".")
            if place == "daq.drivers" or place.startswith(INSTRUMENTS):
                continue
            named = [name for name in imported(path) if name.startswith(INSTRUMENTS)]
            assert not named, f"{path} imports {named}"


def test_every_driver_has_its_simulated_instrument():
    assert {model.scheme for model in models()} == {driver.scheme for driver in DRIVERS}
    for driver in DRIVERS:
        instrument = simulated(driver.scheme, LinearPlant(known_gain))
        assert instrument.gpib_address == driver.gpib_address
        analyser = driver.drive(Loopback(instrument))
        assert analyser.identify().model in driver.models


@pytest.mark.parametrize(
    ("identity", "scheme"),
    [
        ("HEWLETT-PACKARD,35670A,3340A00123,A.01.11", ""),
        ("Agilent Technologies,HP35670A,MY1,A.02.00", ""),
        ("Stanford_Research_Systems,SR785,12345,105", "sr785"),
        ("Stanford_Research_Systems, sr780 ,12345,2.4", "sr785"),
        ("Stanford_Research_Systems,SR830,12345,1.07", None),
        ("35670A", None),
        ("", None),
    ],
)
def test_instrument_is_recognised_by_identity(identity, scheme):
    found = driver_for(identity)
    assert (None if found is None else found.scheme) == scheme


@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: driver.scheme or "preset")
def test_adapter_uses_default_gpib_address(driver):
    lead = f"{driver.scheme}:" if driver.scheme else ""
    assert parse_instrument(f"{lead}prologix:COM3").gpib_address == driver.gpib_address
    assert parse_instrument(f"{lead}prologix-tcp:host:1234?addr=3").gpib_address == 3


def test_one_preset_and_unique_schemes():
    schemes = [driver.scheme for driver in DRIVERS]
    assert schemes.count("") == 1
    assert len(set(schemes)) == len(schemes)


@pytest.mark.parametrize("url", ["sim:", " GPIB0::11::INSTR", "prologix:/dev/ttyUSB0?addr=3"])
def test_an_address_alone_is_for_the_preset(url):
    driver, address = driver_at(url)
    assert (driver.scheme, address) == ("", url.strip())


def test_unknown_scheme_is_refused_with_known_ones():
    with pytest.raises(ConfigurationError, match="sim:, TCPIP"):
        open_analyser("frobnicator:GPIB0::11::INSTR")


@pytest.mark.parametrize("url", ["sr785:", "sr785:foo", "SR785:sim:", "sr785:sr785:sim:"])
def test_invalid_address_is_shown_with_valid_prefixes(url):
    with pytest.raises(ConfigurationError, match="before any of them may stand .*'sr785:'") as told:
        open_analyser(url)
    assert repr(url) in str(told.value)


def test_opened_instrument_can_be_made_safe():
    with served(linear_analyser(known_gain)) as url:
        analyser = open_analyser(url)
        try:
            assert analyser.identify().model == "35670A"
            assert analyser.make_safe() is SourceState.CONFIRMED_OFF
        finally:
            analyser.close()


def test_sweep_is_checked_against_addressed_instrument():
    check_sweep("sim:", SweepPlan((10.0, 20.0), (1.0,)), 10.0, (None, None))
    with pytest.raises(LimitError):
        check_sweep("sim:", SweepPlan((10.0, 20.0), (99.0,)), 10.0, (None, None))


@pytest.mark.parametrize(
    "url",
    ["TCPIP::nowhere.invalid::1::SOCKET", "prologix-tcp:nowhere.invalid:1?addr=11",
     "TCPIP::nowhere.invalid::inst0::INSTR", "prologix:/nowhere/tty?addr=11"],
)  # fmt: skip
def test_loading_drivers_opens_nothing(url):
    load_all_of(url)
    with pytest.raises(LinkError):
        open_analyser(url)

"""The one table of drivers: nobody else names one."""

import ast
from pathlib import Path

import pytest
from bench_server import linear_analyser, served
from fake_analyser import known_gain

import daq
from daq.analyser import SourceState
from daq.drivers import DRIVERS, check_sweep, driver_at, load_all_of, open_analyser
from daq.errors import ConfigurationError, LimitError, LinkError
from daq.plan import SweepPlan

ROOT = Path(daq.__file__).parents[1]
INSTRUMENTS = ("daq.hp35670a",)
"""How modules of instruments begin."""


def imported(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{name.name}" for name in node.names)


def test_nobody_but_the_table_names_a_driver():
    for floor in ("daq", "analysis", "tui"):
        for path in (ROOT / floor).rglob("*.py"):
            if path.name == "drivers.py" or path.name.startswith("hp35670a"):
                continue
            named = [name for name in imported(path) if name.startswith(INSTRUMENTS)]
            assert not named, f"{path} imports {named}"


def test_there_is_one_preset_and_no_scheme_twice():
    schemes = [driver.scheme for driver in DRIVERS]
    assert schemes.count("") == 1
    assert len(set(schemes)) == len(schemes)


@pytest.mark.parametrize("url", ["sim:", " GPIB0::11::INSTR", "prologix:/dev/ttyUSB0?addr=3"])
def test_an_address_alone_is_for_the_preset(url):
    driver, address = driver_at(url)
    assert (driver.scheme, address) == ("", url.strip())


def test_an_unknown_scheme_is_refused_with_those_there_are():
    with pytest.raises(ConfigurationError, match="sim:, TCPIP"):
        open_analyser("frobnicator:GPIB0::11::INSTR")


def test_it_opens_an_instrument_that_can_be_made_safe():
    with served(linear_analyser(known_gain)) as url:
        analyser = open_analyser(url)
        try:
            assert analyser.identify().model == "35670A"
            assert analyser.make_safe() is SourceState.CONFIRMED_OFF
        finally:
            analyser.close()


def test_what_the_instrument_cannot_be_set_to_is_refused_for_its_address():
    check_sweep("sim:", SweepPlan((10.0, 20.0), (1.0,)), 10.0, (None, None))
    with pytest.raises(LimitError):
        check_sweep("sim:", SweepPlan((10.0, 20.0), (99.0,)), 10.0, (None, None))


@pytest.mark.parametrize(
    "url",
    ["TCPIP::nowhere.invalid::1::SOCKET", "prologix-tcp:nowhere.invalid:1?addr=11",
     "TCPIP::nowhere.invalid::inst0::INSTR", "prologix:/nowhere/tty?addr=11"],
)  # fmt: skip
def test_loading_opens_nothing(url):
    load_all_of(url)
    with pytest.raises(LinkError):
        open_analyser(url)

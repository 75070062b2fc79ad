"""One rule for every setting of the driver: unit sent, range refused, read-back compared.

The instrument is the simulated one, met over its in-process transport; what
it accepts and how it rounds was written from the manuals by itself.
"""

import math
import operator
import re

import pytest

from daq.analyser import PointSettings, SourceState
from daq.driving.scpi_connection import Dialogue
from daq.driving.settings import Choice, Number, Switch
from daq.errors import InstrumentError, LimitError
from daq.hp35670a import HP35670A
from daq.hp35670a.settings import LEVEL, SETTINGS, check_drive, standing_settings
from daq.hp35670a.setup import enter_swept_sine, planned_settings
from sim.analyser35670a import Analyser35670A, Choices, LinearPlant
from sim.loopback import Loopback

IDS = [setting.name for setting in SETTINGS]
NAME = operator.attrgetter("name")

SAMPLES = {
    "span (Hz)": (50.0, 1000.3),
    "start (Hz)": (50.01, 100.0),
    "stop (Hz)": (200.01, 1000.0),
    "manual frequency (Hz)": (60.0, 123.456),
    "points of a sweep": (3, 101, 801),
    "settle cycles": (0, 5, 500),
    "integrate cycles": (1, 30, 234),
    "source level (V peak)": (0.1, 0.2999, 2.5, 5.0),
    "source offset (V)": (-2.0, -0.0004, 1.2345, 3.333),
    "source slew (V peak/s)": (0.0, 10.0, 10000.0),
    "channel 1 range (V peak)": (3.99e-3, 1.0, 31.7),
    "channel 2 range (V peak)": (5.0e-3, 2.0, 10.0),
}


@pytest.fixture
def dialogue():
    instrument = Analyser35670A(LinearPlant(lambda hz: 0.5 + 0j))
    talk = Dialogue(Loopback(instrument))
    talk.recover()
    enter_swept_sine(talk)
    return talk


def samples(setting) -> tuple:
    if isinstance(setting, Number):
        return SAMPLES[setting.name]
    return (True, False) if isinstance(setting, Switch) else setting.words


@pytest.mark.parametrize("setting", SETTINGS, ids=IDS)
def test_every_setting_reads_back_as_sent(dialogue, setting):
    if setting.name == "manual frequency (Hz)":
        dialogue.send("FREQ:STAR 50 HZ;:FREQ:STOP 200 HZ")
    for value in samples(setting):
        if setting.name == "channel 1 on" and value is False:
            continue  # the instrument refuses it, see below
        if setting.name == "source offset (V)":
            dialogue.send("SOUR:VOLT 0 VPK")
        shown = dialogue.apply(setting, value)
        assert shown
        dialogue.check(setting.name, harmless=lambda entry: entry.number == -221)


def test_the_first_channel_cannot_be_switched_off(dialogue):
    switch = next(setting for setting in SETTINGS if setting.name == "channel 1 on")
    with pytest.raises(InstrumentError, match="cannot be disabled"):
        dialogue.apply(switch, False)


@pytest.mark.parametrize(
    "setting", [setting for setting in SETTINGS if isinstance(setting, Number)], ids=NAME
)
def test_number_has_unit_and_refuses_range(setting):
    beyond = [math.nextafter(setting.low, -math.inf), math.nextafter(setting.high, math.inf)]
    for value in (*beyond, math.nan, math.inf, -math.inf, True, "1", None):
        with pytest.raises(LimitError, match=re.escape(setting.name)):
            setting.command(value)
    for value in (setting.low, setting.high):
        line = setting.command(value)
        assert setting.unit
        assert line.endswith(f" {setting.unit}")
        assert len(line) < 120


@pytest.mark.parametrize(
    "setting", [setting for setting in SETTINGS if isinstance(setting, Number)], ids=NAME
)
def test_read_back_elsewhere_is_never_accepted(setting):
    for value in SAMPLES[setting.name]:
        if value <= 0:
            continue
        unit = setting.unit if setting.asks_unit else None
        assert setting.accepts(value, f"{value:+.11E}", unit)
        assert not setting.accepts(value, f"{2.0 * value + 1.0:+.11E}", unit)
        assert not setting.accepts(value, f"{-value:+.11E}", unit)


@pytest.mark.parametrize(
    "setting", [setting for setting in SETTINGS if isinstance(setting, Choice)], ids=NAME
)
def test_every_choice_refuses_other_words(setting):
    for word in ("", "X", setting.words[0].lower() + "x", 1, None):
        with pytest.raises(LimitError):
            setting.command(word)


def test_names_and_headers_are_unique():
    assert len({setting.name for setting in SETTINGS}) == len(SETTINGS)
    assert len({setting.header for setting in SETTINGS}) == len(SETTINGS)


def test_settings_differing_after_preset_are_sent():
    """Reset and preset leave them different."""
    always = {setting.header: value for setting, value in standing_settings()}
    assert always["FREQ:RES:AUTO"] is False
    assert always["CAL:AUTO"] is False
    assert always["INIT:CONT"] is False
    assert always["FREQ:SPAN:LINK"] == "STAR"


def test_amplitude_in_another_unit_is_converted(dialogue):
    dialogue.send("SOUR:VOLT 1 VRMS")
    reply, unit = dialogue.read_back(LEVEL)
    assert unit == "VRMS"
    assert LEVEL.value_of(reply, unit) == pytest.approx(math.sqrt(2.0), abs=2.5e-3)
    # In decibels 0 is not silence.
    dialogue.send("SOUR:VOLT 0 DBVRMS")
    assert LEVEL.value_of(*dialogue.read_back(LEVEL)) == pytest.approx(math.sqrt(2.0), abs=2.5e-3)


# What the source cannot do as asked


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"source_vpk": 0.0}, "a level of 0 parks the sweep"),
        ({"source_vpk": 1e-4}, "below the smallest step"),
        ({"source_vpk": -1.0}, "outside the instrument's 0 to 5"),
        ({"source_vpk": 5.01}, "outside the instrument's 0 to 5"),
        ({"dc_offset_v": 11.0}, "outside the instrument's -10 to 10"),
        ({"dc_offset_v": -8.0}, "would move the offset"),
        ({"settle_cycles": -1}, "settle cycles"),
        ({"integrate_cycles": 0}, "integrate cycles"),
        ({"integrate_cycles": 235}, "integrate cycles 235 is outside"),
        ({"slew_vpk_per_s": -1.0}, "slew"),
        ({"input_range_vpk": (40.0, None)}, "channel 1 range"),
        ({"input_range_vpk": (None, 1e-3)}, "channel 2 range"),
    ],
)
def test_bad_point_settings_are_refused_unsent(changes, fault):
    settings = PointSettings(**({"source_vpk": 2.5, "settle_cycles": 5, "integrate_cycles": 30}
                                | changes))  # fmt: skip
    with pytest.raises(LimitError, match=fault):
        planned_settings(50.0, 200.0, settings)


@pytest.mark.parametrize("band", [(0.0, 100.0), (10.0, 60000.0), (math.nan, 100.0)])
def test_bad_bands_are_refused_unsent(band):
    with pytest.raises(LimitError, match="nothing was sent"):
        planned_settings(*band, PointSettings(2.5, 5, 30))


def test_level_and_offset_at_bound_are_accepted():
    check_drive(PointSettings(5.0, 5, 30, dc_offset_v=-5.0))


def test_units_between_quotes_are_the_same_units():
    """Nobody says whether ``? UNIT`` is answered with quotes."""
    taken = []
    for quoted in (False, True):
        box = Analyser35670A(LinearPlant(lambda hz: 0.5 + 0j), Choices(unit_quoted=quoted))
        analyser = HP35670A(Loopback(box))
        analyser.identify()
        read_back = analyser.prepare(100.0, 200.0, PointSettings(1.5, 2, 3))
        taken.append((dict(read_back), list(analyser.sweep((120.0, 150.0)))))
        assert analyser.make_safe() is SourceState.CONFIRMED_OFF
        assert box.driven_v == 0.0
    assert taken[0] == taken[1]

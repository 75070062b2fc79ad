"""A sampled bench: the sine block by block, the lock-in, the delay, a sound card, a servo."""

import math
import sys
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from instruments.bench_server import simulated
from instruments.fake_analyser import known_gain

from analysis.resonance import extract
from daq.analyser import PointSettings, SourceState
from daq.drivers import driver_at, open_analyser
from daq.errors import ConfigurationError, InstrumentError, LimitError, LinkError
from daq.sampled.lockin import amplitudes, delay_of
from daq.sampled.stream import StreamConverter
from daq.session.instrument_claim import wire_name
from daq.store import Store
from sim.instrument.plant import LinearPlant
from sim.loopback import Loopback
from tui import cli
from tui.bench import drives_hardware

RATE = 48_000.0


def made(converter, blocks):
    """What a converter gives in blocks of such sizes, its output looped to both inputs."""
    out = []
    for size in blocks:
        out.append(converter.exchange(np.zeros((size, 2))))
    return np.concatenate(out)


# The sine


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(1, 700), min_size=20, max_size=60), st.floats(10.0, 5000.0))
def test_sine_is_continuous_across_blocks(blocks, hz):
    converter = StreamConverter("test", RATE, 10.0, (1.0, 1.0))
    converter.step(100.0, 10)
    made(converter, [64])
    converter.aim(2.0, 0.0, 50.0)
    first = made(converter, blocks[: len(blocks) // 2])
    converter.step(hz, 100)
    second = made(converter, blocks[len(blocks) // 2 :])
    volts = 10.0 * np.concatenate([first, second])
    fastest = 2 * math.pi * max(100.0, hz) / RATE * 2.0 + 50.0 / RATE
    assert np.abs(np.diff(volts)).max() <= fastest * 1.05 + 1e-9
    assert np.abs(volts).max() <= 2.0 + 1e-9


def test_level_follows_slew_rate_to_exact_zero():
    converter = StreamConverter("test", RATE, 10.0, (1.0, 1.0))
    converter.aim(1.0, 0.5, 10.0)
    made(converter, [480])
    level, offset = converter.now()
    assert (level, offset) == (pytest.approx(0.1), pytest.approx(0.1))
    made(converter, [4800])
    assert converter.now() == (1.0, 0.5)
    converter.aim(0.0, 0.0, 10.0)
    tail = made(converter, [5000])
    assert converter.now() == (0.0, 0.0)
    assert tail[-100:] == pytest.approx(0.0, abs=0.0)


def test_recording_starts_with_step_and_requested_length():
    converter = StreamConverter("test", RATE, 1.0, (2.0, 3.0))
    converter.step(123.0, 1000)
    assert converter.recorded() == 0
    for _ in range(10):
        out = converter.exchange(np.ones((256, 2)))
        assert len(out) == 256
    assert converter.recorded() == 1000
    assert converter.frames(990, 10) == pytest.approx(np.tile([2.0, 3.0], (10, 1)))
    assert converter.trouble() == (0, 3)


# The lock-in


@settings(max_examples=20, deadline=None)
@given(st.floats(5.0, 9000.0), st.floats(0.0, 400.0), st.floats(-3.1, 3.1), st.floats(0.01, 5.0))
def test_amplitude_ignores_offset_and_harmonics(hz, first, phase, level):
    frames = np.arange(int(first + 6 * RATE / hz) + 2)
    turns = 2 * math.pi * hz / RATE * frames
    volts = 0.3 + level * np.sin(turns + phase)
    if hz < 1000:
        volts = volts + 0.1 * level * np.sin(3 * turns + 1.0)
    found = amplitudes(volts[:, None], first, hz, RATE, 5)
    assert found[0] == pytest.approx(np.full(5, level * np.exp(1j * phase)), rel=1e-6)


@given(st.floats(0.0, 0.19), st.floats(50.0, 500.0))
def test_delay_follows_from_two_frequencies(delay, hz):
    pair = (hz, hz + 5.0)
    seen = tuple(np.exp(-2j * math.pi * f * delay) for f in pair)
    assert delay_of(seen, pair) == pytest.approx(delay, abs=1e-9) or delay < 1e-9


# The bench


def prepared(box, **changes):
    driver, _ = driver_at("sampled:sim:")
    analyser = driver.drive(Loopback(box))
    analyser.identify()
    wanted = {"source_vpk": 1.0, "settle_cycles": 3, "integrate_cycles": 10, "slew_vpk_per_s": 0.0}
    analyser.prepare(50.0, 500.0, PointSettings(**(wanted | changes)))
    return analyser


def test_delay_of_two_milliseconds_is_compensated():
    box = simulated("sampled", LinearPlant(known_gain))
    for point in prepared(box).sweep((60.0, 139.7, 140.3, 333.3, 499.0)):
        true = known_gain(point.frequency_hz)
        assert point.detail["delay_s"] == pytest.approx(2e-3, abs=2e-6)
        assert point.detail["source_vpk"] == pytest.approx(1.0, rel=1e-6)
        assert abs(point.gain) == pytest.approx(abs(true), rel=1e-5)
        assert np.angle(point.gain / true) == pytest.approx(0.0, abs=1e-5)
    assert box.driven_v == 0.0


def test_missing_or_wrong_loop_back_is_refused():
    class Weak(LinearPlant):
        def dwell(self, *words):
            found = super().dwell(*words)
            return type(found)(found.source_cycles * 0.5, found.output_cycles,
                               found.source_peak_v, found.output_peak_v)  # fmt: skip

    box = simulated("sampled", Weak(known_gain))
    with pytest.raises(InstrumentError, match="loop-back reads 0.5 V peak where 1 V was set"):
        list(prepared(box).sweep((100.0,)))
    assert box.driven_v == 0.0


def test_sampled_measurement_agrees_with_analyser(tmp_path):
    """ARF and RF of the same servo through both, within their own error bars."""
    found = []
    for url in ("sim:?ratio=0.3&seed=2", "sampled:sim:?ratio=0.3&seed=2"):
        db = tmp_path / f"{len(found)}.db"
        words = ["measure", "--unit", "adss", "--instrument", url, "--db", str(db), "--level",
                 "2.5", "--start", "100", "--stop", "180", "--points", "41", "--settle-cycles",
                 "10", "--integrate-cycles", "20"]  # fmt: skip
        assert cli.main(words) == 0
        with Store(db) as store:
            (level,) = extract(store.response(1))
        found.append(level)
    for name in ("arf", "rf"):
        one, other = (getattr(level, name) for level in found)
        apart = abs(one.frequency_hz - other.frequency_hz)
        assert apart <= 4.0 * math.hypot(one.std_hz, other.std_hz)


# A sound card

CARD = '''
"""A card whose output is looped to input 1, and at half to input 2, 96 frames late."""
import threading, time
import numpy as np

plugged = True

class Stream:
    def __init__(self, samplerate, blocksize, device, channels, dtype, latency, callback):
        if device == "nothing":
            raise ValueError("no such device")
        self._work, self._size, self._rate = callback, blocksize, samplerate
        self._late = np.zeros((96, 1))
        self.active = False
    def start(self):
        self.active = True
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
    def _run(self):
        while self.active and plugged:
            out = np.zeros((self._size, 2), dtype="float32")
            came, self._late = self._late[: self._size], self._late[self._size :]
            short = self._size - len(came)
            came = np.vstack([came, np.zeros((short, 1))]) if short > 0 else came
            self._work(np.hstack([came, 0.5 * came]), out, self._size, None, None)
            self._late = np.vstack([self._late, out[:, :1]])
            time.sleep(self._size / self._rate / 20)
        self.active = False
    def abort(self):
        self.active = False
        self._thread.join()
    def close(self):
        pass
'''


@pytest.fixture
def card(tmp_path, monkeypatch):
    (tmp_path / "sounddevice.py").write_text(CARD)
    monkeypatch.syspath_prepend(tmp_path)
    yield
    sys.modules.pop("sounddevice", None)


def test_sound_card_measures_a_response(card):
    import sounddevice

    url = "sampled:sound:default?out=1.5&in1=1.5&in2=1.5&block=64"
    assert drives_hardware(url)
    assert wire_name(url) == wire_name("sampled:sound:default?out=2&in1=1&in2=1")
    analyser = open_analyser(url)
    assert not analyser.identify().simulated
    analyser.prepare(100.0, 400.0, PointSettings(1.0, 2, 4, slew_vpk_per_s=100.0))
    for point in analyser.sweep((200.0, 150.0)):
        assert point.gain == pytest.approx(0.5, rel=1e-4)
    assert analyser.make_safe() is SourceState.CONFIRMED_OFF
    analyser.prepare(100.0, 400.0, PointSettings(1.0, 2, 4, slew_vpk_per_s=100.0))
    points = analyser.sweep((200.0, 150.0))
    next(points)
    sounddevice.plugged = False
    time.sleep(0.1)
    with pytest.raises(LinkError, match="was it unplugged"):
        next(points)
    assert analyser.make_safe() is SourceState.UNKNOWN
    analyser.close()


@pytest.mark.parametrize(
    ("url", "fault", "said"),
    [
        ("sampled:sound:default", ConfigurationError, "out, in1, in2 must be given"),
        ("sampled:sound:x?out=1&in1=1&in2=1&gain=2", ConfigurationError, "gain is not known"),
        ("sampled:sound:x?out=1&in1=1&in2=loud", ConfigurationError, "loud"),
        ("sampled:sound:x?out=0&in1=1&in2=1", ConfigurationError, "volts above 0"),
        ("sampled:sound:nothing?out=1&in1=1&in2=1", LinkError, "no such device"),
        ("sampled:nidaq:?range=10", ConfigurationError, "a device, rate"),
        ("sampled:nidaq:Dev1?range=11", ConfigurationError, "range up to 10 V"),
        ("sampled:nidaq:Dev1", LinkError, "needs nidaqmx"),
    ],
)
def test_missing_device_is_one_line(card, url, fault, said):
    with pytest.raises(fault, match=said) as told:
        open_analyser(url)
    assert "\n" not in str(told.value)


def test_a_plan_beyond_the_converter_is_refused():
    box = simulated("sampled", LinearPlant(known_gain))
    driver, _ = driver_at("sampled:sim:")
    analyser = driver.drive(Loopback(box))
    analyser.identify()
    analyser.prepare(100.0, 200.0, PointSettings(1.0, 2, 3))
    with pytest.raises(LimitError, match="highest frequency .* is not within"):
        analyser.prepare(100.0, 20_000.0, PointSettings(1.0, 2, 3))
    assert box.driven_v == 0.0

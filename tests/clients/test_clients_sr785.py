"""Programs of others and the simulated SR785, over real sockets; `make clients` runs them."""

import numpy as np
import pytest
import pyvisa
from instruments.bench_server import served, simulated
from instruments.fake_analyser import known_gain
from instruments.vxi11 import Gateway
from instruments.wire import ByteServer
from lan_gpib import LanGpib

from sim.instrument.plant import LinearPlant

pytestmark = [pytest.mark.clients, pytest.mark.filterwarnings("ignore")]


@pytest.fixture
def box(heard):
    return heard(simulated("sr785", LinearPlant(known_gain), noise_v=1e-5))


def place(url):
    """HOST:PORT of an adapter's URL."""
    return url.removeprefix("sr785:").removeprefix("prologix-tcp:").partition("?")[0]


SWEPT_SINE = (
    "OUTX0", "DFMT1", "MGRP2,3", "MEAS0,47", "MEAS1,47", "VIEW0,0", "VIEW1,5", "UNDB0,1",
    "UNDB1,0", "UNPH1,0", "DISP0,1", "DISP1,1", "SSAM 500.0 mV", "SSTR2,100.0Hz", "SSTP2,200.0Hz",
    "SNPS2,21", "SSTY2,0", "SRPT2,0", "SITM2,10.0mS", "SICY2,5", "SSTM2,10.0mS", "SSCY2,5",
)  # fmt: skip


def test_ligo_script_measures_transfer_function(box):
    """Its script's order of commands: no blank before arguments, bit 4 of the display word."""
    with served(box, "prologix_tcp", "sr785") as url:
        ask = LanGpib(place(url), 10)
        ask.command("OUTX0")
        assert "SR785" in ask.text("*IDN?")
        # PSD units can be stuck in swept sine.
        assert ask.text("PSDU?0")[0] == "0"
        for line in (*SWEPT_SINE, "SRCO1", "STRT"):
            ask.command(line)
        assert ask.whole("SNPS?0") == 21
        ask.until(lambda: ask.whole("DSPS?4"))
        assert ask.whole("DFMT?") == 1
        found = []
        for display in (0, 1):
            count = ask.whole(f"DSPN?{display}")
            bins = [
                (float(ask.text(f"DBIN?{display},{bin}")), float(ask.text(f"DSPY?{display},{bin}")))
                for bin in range(count)
            ]
            found.append(np.array(bins[:-1]))
        ask.command("SRCO0")
        ask.close()
    hertz, decibels = found[0].T
    true = np.array([known_gain(hz) for hz in hertz])
    assert decibels == pytest.approx(20 * np.log10(abs(true)), abs=0.05)
    assert found[1][:, 1] == pytest.approx(np.degrees(np.angle(true)), abs=0.5)
    assert box.driven_v == 0.0


def test_ligo_script_measures_spectrum(box):
    with served(box, "prologix_tcp", "sr785") as url:
        ask = LanGpib(place(url), 10)
        for line in ("OUTX0", "DFMT1", "I1CP0", "I2CP0", "I1GD0", "I2GD0", "A1RG0", "A2RG0",
                     "I1AR0", "I2AR0", "A1RG1", "A2RG1", "I1AF1", "I2AF1", "MGRP2,0", "ISRC1",
                     "FBAS2,1"):  # fmt: skip
            ask.command(line)
        for display in (0, 1):
            for line in ("ACTD{0}", "MEAS{0},{0}", "VIEW{0},0", "UNDB{0},0", "UNPK{0},2",
                         "PSDU{0},1", "DISP{0},1"):  # fmt: skip
                ask.command(line.format(display))
        for line in ("FSPN2,12.8kHz", "FLIN2,2", "FAVG2,1", "FAVM2,2", "FAVT2,0", "FREJ2,1",
                     "FAVN2,5", "FWIN2,2", "STRT"):  # fmt: skip
            ask.command(line)
        ask.until(lambda: ask.whole("DSPS?1"))
        assert ask.whole("NAVG?0") >= 1
        assert ask.whole("DSPN?0") > 100
        for display in (0, 1):
            ask.command(f"PSDU{display},0")
        assert ask.whole("MGRP?0") == 0
        ask.close()


def test_a_labrad_server_reads_whole_traces(box):
    """GPIB through VISA, a bus server in between: replies on GPIB, whole displays in binary."""
    with ByteServer(Gateway(box).feed) as gateway:
        manager = pyvisa.ResourceManager("@py")
        bus = manager.open_resource(f"TCPIP::127.0.0.1,{gateway.port}::inst0::INSTR")
        bus.write_termination = "\n"
        bus.timeout = 10_000
        bus.write("*CLS")
        bus.write("OUTX 0")
        assert "SR785" in bus.query("*IDN?")
        for line in SWEPT_SINE[1:]:
            bus.write(line)
        bus.write("SRCO 1")
        bus.write("STRT")
        while not int(bus.query("DSPS? 4")):
            pass
        count = int(bus.query("DSPN? 0"))
        first, last = (float(bus.query(f"DBIN? 0,{at}")) for at in (0, count - 2))
        hertz = np.linspace(first, last, count - 1)
        assert hertz[1] == pytest.approx(float(bus.query("DBIN? 0,1")), abs=1e-3)
        text = np.array(bus.query_ascii_values("DSPY? 0"))[: count - 1]
        binary = np.array(
            bus.query_binary_values("DSPB? 0", datatype="f", header_fmt="empty",
                                    data_points=count, expect_termination=False)
        )[: count - 1]  # fmt: skip
        assert binary == pytest.approx(text, rel=1e-4)
        true = np.array([known_gain(hz) for hz in hertz])
        assert text == pytest.approx(20 * np.log10(abs(true)), abs=0.05)
        bus.write("SRCO 0")
        bus.close()


def test_pymeasure_driver_reads_sr785(box):
    """Its VISA adapter and common commands, unchanged; it has no driver of an SR785."""
    adapters = pytest.importorskip("pymeasure.adapters")
    instruments = pytest.importorskip("pymeasure.instruments")

    class Analyser(instruments.Instrument):
        points = instruments.Instrument.control("SNPS?0", "SNPS2,%d", "", cast=int)
        level = instruments.Instrument.setting("SSAM %g mV", "")

    with served(box, "tcp", "sr785") as url:
        way = adapters.VISAAdapter(
            url.removeprefix("sr785:"), visa_library="@py", read_termination="\n",
            write_termination="\n", timeout=5000,
        )  # fmt: skip
        analyser = Analyser(way, "SR785", includeSCPI=False)
        analyser.write("OUTX0")
        assert "SR785" in analyser.ask("*IDN?")
        analyser.write("MGRP2,3")
        analyser.points = 31
        analyser.level = 0
        assert analyser.points == 31
        analyser.adapter.close()

"""Programs of others and the simulated 35670A, over real sockets; `make clients` runs them."""

import threading
import time

import numpy as np
import pytest
import pyvisa
from instruments.bench_server import linear_analyser, served
from instruments.fake_analyser import known_gain
from lan_gpib import LanGpib

pytestmark = [pytest.mark.clients, pytest.mark.filterwarnings("ignore")]


@pytest.fixture
def box(heard):
    return heard(linear_analyser(known_gain, noise_v=1e-4, converter_noise=1e-5))


def place(url):
    """HOST:PORT of an adapter's URL."""
    return url.removeprefix("prologix-tcp:").partition("?")[0]


def test_fft_dev_package_works(box):
    """Its driver of the 35670A over a Prologix on the network, unchanged."""
    client = pytest.importorskip("fft_dev.fft35670a.fft35670a_dev_prologix")
    with served(box, "prologix_tcp") as url:
        host, port = place(url).split(":")
        device = client.Fft35670aDevPrologix(host, int(port), 11)
        assert device.connect() is True
        assert device.idn.startswith("HEWLETT-PACKARD,35670A")
        device.write("*CLS")
        for channel in (1, 2):
            device.set_input_autorange_state(channel, True)
        device.set_source_offset(0.0)
        device.set_freq_start(0)
        device.set_freq_stop(1600)
        device.write("AVER:STAT ON")
        device.write("AVER:COUN 3")
        going_on = threading.Event()
        going_on.set()
        assert device.acquisition(going_on) is True
        data, axis = device.get_ydata(1), device.get_xdata(1)
        assert len(data) == 401
        # It cuts the axis, which is longer than the data, as its author found it to be.
        axis = axis[: len(data)]
        assert (axis[0], axis[-1]) == (0.0, pytest.approx(1600.0))
        device.write("SYST:ERR?")
        said = device.read(64, 2.0)
        # It asks to read once more for each piece of a block that it takes.
        assert said.startswith(("+0,", "-420,")), said
        device.close()


def test_pymeasure_works_over_visa_and_prologix(box):
    """Its adapters and its SCPI mix-in, unchanged; the commands are those of its PR 1435."""
    adapters = pytest.importorskip("pymeasure.adapters")
    instruments = pytest.importorskip("pymeasure.instruments")

    class Analyser(instruments.SCPIMixin, instruments.Instrument):
        mode = instruments.Instrument.control("INST:SEL?", "INST:SEL %s", "")
        start = instruments.Instrument.control("FREQ:STAR?", "FREQ:STAR %g HZ", "")
        stop = instruments.Instrument.control("FREQ:STOP?", "FREQ:STOP %g HZ", "")
        output = instruments.Instrument.control(
            "OUTP?", "OUTP %d", "", map_values=True, values={True: 1, False: 0}, cast=int
        )
        unit = instruments.Instrument.control("CALC1:UNIT:VOLT?", "CALC1:UNIT:VOLT '%s'", "")

    def by_visa(url):
        return adapters.VISAAdapter(
            url, visa_library="@py", read_termination="\n", write_termination="\n", timeout=5000
        )

    def by_prologix(url):
        host, port = place(url).split(":")
        return adapters.PrologixAdapter(
            f"TCPIP::{host}::{port}::SOCKET",
            11,
            visa_library="@py",
            timeout=5000,
            read_termination="\n",
            write_termination="\n",
        )

    for wire, way in (("tcp", by_visa), ("prologix_tcp", by_prologix)):
        with served(box, wire) as url:
            analyser = Analyser(way(url), "35670A", includeSCPI=False)
            analyser.output = False
            assert analyser.id.startswith("HEWLETT-PACKARD,35670A")
            assert "1D2" in analyser.options
            analyser.clear()
            analyser.mode = "FFT"
            analyser.start, analyser.stop = 0, 3200
            assert (float(analyser.start), float(analyser.stop)) == (0.0, 3200.0)
            analyser.write("CALC1:FEED 'XFR:POW 2'")
            time.sleep(0.1)
            analyser.unit = "V2/HZ"
            assert analyser.unit.strip('"') == "V2/HZ"
            analyser.write("INIT:CONT OFF")
            analyser.write("FORM ASC,8")
            analyser.write("ABOR;:INIT")
            while int(analyser.ask("STAT:OPER:COND?")) & 16:
                time.sleep(0.01)
            assert int(analyser.ask("CALC1:DATA:HEAD:POIN?")) == 401
            assert len(analyser.values("CALC1:DATA?")) == 401
            assert float(analyser.ask("CALC1:MARK:FUNC:RES?")) == 9.91e37
            assert not analyser.output
            assert analyser.check_errors() == []
            analyser.adapter.close()


def test_pyvisa_prologix_support_works(box):
    """The interface first, kept open; then the instrument by its GPIB address."""
    with served(box, "prologix_tcp") as url:
        host, port = place(url).split(":")
        manager = pyvisa.ResourceManager("@py")
        adapter = manager.open_resource(f"PRLGX-TCPIP0::{host}::{port}::INTFC")
        analyser = manager.open_resource("GPIB0::11::INSTR")
        adapter.timeout = 5000
        adapter.write_raw(b"++read_tmo_ms 3000\n")
        assert analyser.query("*IDN?").startswith("HEWLETT-PACKARD,35670A")
        for line in ("*RST", "INST:SEL SINE", "INIT:CONT OFF", "FREQ:STAR 100 HZ",
                     "FREQ:STOP 200 HZ", "FREQ:RES:AUTO OFF", "FREQ:RES 5 PNT/SWP",
                     "SOUR:VOLT 1 VPK", "FORM REAL,64", "*CLS", "*ESE 1", "*SRE 32",
                     "ABOR;:INIT;*OPC"):  # fmt: skip
            analyser.write(line)
        while not analyser.read_stb() & 32:
            time.sleep(0.02)
        analyser.write("TRAC D1,TRAC1")
        pairs = analyser.query_binary_values("TRAC? D1", datatype="d", is_big_endian=True)
        hertz = analyser.query_binary_values("TRAC:X? D1", datatype="d", is_big_endian=True)
        gains = np.array(pairs[0::2]) + 1j * np.array(pairs[1::2])
        assert gains[0] == pytest.approx(known_gain(hertz[0]), rel=0.02)
        analyser.write("SOUR:VOLT 0 VPK")
        analyser.close()
        adapter.close()
    assert box.driven_v == 0.0


def test_the_sequence_of_qkit(box):
    """Noise spectra over a Prologix: signed integers, bit 8, an axis that is cut, quoted units."""
    with served(box, "prologix_tcp") as url:
        ask = LanGpib(place(url), 11)

        def ready():
            return not int(ask.query("STAT:OPER:COND?")[1:-1]) & 256

        ask.command("INST:NSEL 0")
        ask.command("FORMAT:DATA ASCii, 6")
        lines = int(float(ask.query("Freq:Res?")[:-1]))
        assert ask.query("INST:NSEL?") == b"+0\n"
        for line in ("INIT:CONT 0", "AVER 1", "AVER:COUN 1", "AVERAGE:TCON FREEZE", ":inp2 ON",
                     ":Input1:Coup DC", "WINDOW HANN", "Freq:Start 0", "Freq:Stop 6400",
                     "CALC1:FEED 'XFR:POW 2'", "INIT:IMM"):  # fmt: skip
            ask.command(line)
        ask.until(ready)
        axis = np.fromstring(ask.text("CALC:X:DATA?"), sep=",")
        assert len(axis) > lines + 1
        axis = axis[: lines + 1]
        assert axis[-1] == pytest.approx(6400.0)
        ask.command('calculate1:unit:voltage "V2/HZ"')
        assert ask.text("CALCulate1:UNIT:VOLTage?").strip('"') == "V2/HZ"
        ask.command("AVER:COUN 20")
        assert int(float(ask.query("AVER:COUN?")[:-1])) == 20
        ask.command("ABOR;:INIT:IMM")
        ask.until(ready)
        trace = np.fromstring(ask.text("CALC1:DATA?"), sep=",")
        assert len(trace) == lines + 1
        ask.command("Calculate:Math:Expr1 (PSD(PSPEC1))")
        ask.command("calculate1:math:state 1")
        ask.command(":calc1:math:select F1")
        assert ask.text("SYST:ERR?").startswith("+0,")
        ask.close()


def test_the_waiting_loop_of_visir(box):
    """Bits of operation until none is left, the event register and the error queue at each look."""
    with served(box, "prologix_tcp") as url:
        ask = LanGpib(place(url), 11)
        for line in ("*RST", "*CLS", "INST:SEL FFT", "INIT:CONT OFF", "VOLT1:RANG:AUTO ON",
                     "CALC1:FEED 'XFR:POW 1'", "ABOR;:INIT"):  # fmt: skip
            ask.command(line)
        seen = []

        def idle():
            seen.append(ask.whole("STAT:OPER:COND?") & 0x3FF)
            assert not ask.whole("*ESR?") & 0x3C
            assert ask.text("SYST:ERR?").startswith("+0,")
            return len(seen) > 2 and not seen[-1]

        ask.until(idle)
        assert ask.text("VOLT1:RANG? UNIT").strip('"') == "DBVRMS"
        ask.close()

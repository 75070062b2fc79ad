"""An NI multifunction device as a sampled bench, through nidaqmx.

Owns both tasks, on one sample clock, and the thread that passes blocks. `lashbench[nidaq]` brings
the library; the maker's driver must be there. UNVERIFIED on a real device.
"""

from __future__ import annotations

import threading
from contextlib import suppress
from typing import Any

import numpy as np

from daq.errors import ConfigurationError, LinkError
from daq.sampled.inside import InsideTransport, device_and_options
from daq.sampled.stream import StreamConverter

__all__ = ["open_nidaq"]

_OPTIONS = {"rate": "48000", "range": "10", "ao": "ao0", "ai": "ai0:1"}
_BLOCK = 1024
_AHEAD = 4
_PATIENCE_S = 5.0


def open_nidaq(rest: str) -> InsideTransport:
    """Open ``nidaq:Dev1?rate=48000&range=10&ao=ao0&ai=ai0:1``.

    Raises
    ------
    ConfigurationError
        If an option is not known, or no number.
    LinkError
        If the library or the device is not there.
    """
    device, options = device_and_options("nidaq", rest, _OPTIONS)
    try:
        rate, full_v = float(options["rate"]), float(options["range"])
    except ValueError as error:
        raise ConfigurationError(f"nidaq:{rest}: {error}") from error
    if not (1000 <= rate <= 1e6 and 0 < full_v <= 10.0) or not device:
        raise ConfigurationError(f"nidaq:{rest}: a device, rate 1000 to 1000000, range up to 10 V")
    try:
        import nidaqmx  # pyright: ignore[reportMissingImports] # an extra
        from nidaqmx.constants import AcquisitionType, RegenerationMode  # pyright: ignore[reportMissingImports] # an extra
    except (ImportError, OSError) as error:
        raise LinkError(
            f"nidaq:{device}: needs nidaqmx and the maker's driver ({error}); "
            "pip install 'lashbench[nidaq]'"
        ) from error
    converter = StreamConverter(f"nidaq {device}", rate, full_v, (full_v, full_v))
    tasks: list[Any] = []
    try:
        source, inputs = nidaqmx.Task(), nidaqmx.Task()
        tasks += [source, inputs]
        source.ao_channels.add_ao_voltage_chan(
            f"{device}/{options['ao']}", min_val=-full_v, max_val=full_v
        )
        inputs.ai_channels.add_ai_voltage_chan(
            f"{device}/{options['ai']}", min_val=-full_v, max_val=full_v
        )
        inputs.timing.cfg_samp_clk_timing(
            rate, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=64 * _BLOCK
        )
        # One clock: the output follows that of the inputs.
        source.timing.cfg_samp_clk_timing(
            rate, source=f"/{device}/ai/SampleClock", sample_mode=AcquisitionType.CONTINUOUS,
            samps_per_chan=_AHEAD * _BLOCK,
        )  # fmt: skip
        source.out_stream.regen_mode = RegenerationMode.DONT_ALLOW_REGENERATION
        source.write(np.zeros(_AHEAD * _BLOCK), auto_start=False)
        source.start()
        inputs.start()
    except Exception as error:  # the library raises its own errors
        _end(tasks)
        raise LinkError(
            f"nidaq:{device}: cannot be set up ({' '.join(str(error).split())})"
        ) from error
    stopping, fault = threading.Event(), list[str]()

    def run() -> None:
        try:
            while not stopping.is_set():
                came = np.asarray(
                    inputs.read(number_of_samples_per_channel=_BLOCK, timeout=_PATIENCE_S)
                ).T
                source.write(converter.exchange(came / full_v) * full_v, timeout=_PATIENCE_S)
        except Exception as error:
            fault.append(" ".join(str(error).split()))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()

    def alive() -> None:
        if fault:
            raise LinkError(f"nidaq:{device}: the stream has stopped ({fault[0]})")

    def close() -> None:
        stopping.set()
        thread.join(_PATIENCE_S)
        _end(tasks)
        # What an output holds after its task is its last value.
        with suppress(Exception), nidaqmx.Task() as rest_task:
            rest_task.ao_channels.add_ao_voltage_chan(f"{device}/{options['ao']}")
            rest_task.write(0.0)

    return InsideTransport(converter, f"nidaq:{rest}", close, alive)


def _end(tasks: list[Any]) -> None:
    for task in tasks:
        with suppress(Exception):
            task.stop()
        with suppress(Exception):
            task.close()

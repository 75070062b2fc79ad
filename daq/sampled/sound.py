"""A sound card as a sampled bench, through sounddevice (PortAudio).

Owns the device's stream. `lashbench[sound]` brings the library. UNVERIFIED on a real card.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from daq.errors import ConfigurationError, LinkError
from daq.sampled.inside import InsideTransport, device_and_options
from daq.sampled.stream import StreamConverter

__all__ = ["open_sound"]

_OPTIONS = {"rate": "48000", "out": "", "in1": "", "in2": "", "block": "256"}
_STARTING_S = 3.0


def open_sound(rest: str) -> InsideTransport:
    """Open ``sound:DEVICE?rate=48000&out=V&in1=V&in2=V``.

    `out`, `in1` and `in2` are the volts of digital full scale, measured once with a voltmeter;
    DEVICE is a name or number of the library's list, or `default`.

    Raises
    ------
    ConfigurationError
        If an option is not known, or no number.
    LinkError
        If the library or the device is not there.
    """
    device, options = device_and_options("sound", rest, _OPTIONS)
    try:
        rate, out_v, in1_v, in2_v = (float(options[n]) for n in ("rate", "out", "in1", "in2"))
        block = int(options["block"])
    except ValueError as error:
        raise ConfigurationError(f"sound:{rest}: {error}") from error
    if not (8000 <= rate <= 384_000 and min(out_v, in1_v, in2_v) > 0 and 16 <= block <= 16384):
        raise ConfigurationError(
            f"sound:{rest}: rate 8000 to 384000, block 16 to 16384, volts above 0"
        )
    try:
        import sounddevice  # pyright: ignore[reportMissingImports] # an extra
    except (ImportError, OSError) as error:
        raise LinkError(
            f"sound:{device}: needs sounddevice and PortAudio ({error}); "
            "pip install 'lashbench[sound]'"
        ) from error
    converter = StreamConverter(f"sound {device}", rate, out_v, (in1_v, in2_v))
    blocks = 0

    def turn(came: Any, goes: Any, frames: int, times: Any, status: Any) -> None:
        nonlocal blocks
        blocks += 1
        made = converter.exchange(np.asarray(came, dtype=float)[:, :2], frames if status else 0)
        goes[:] = 0.0
        goes[:, 0] = made

    place: Any = None if device in ("", "default") else device
    try:
        stream = sounddevice.Stream(
            samplerate=rate, blocksize=block, device=place, channels=2, dtype="float32",
            latency="low", callback=turn,
        )  # fmt: skip
        stream.start()
    except Exception as error:  # the library raises its own errors, ValueError, OSError
        raise LinkError(
            f"sound:{device}: cannot be opened ({' '.join(str(error).split())}); is it plugged in, "
            "and does it have two inputs?"
        ) from error

    def alive() -> None:
        if not stream.active:
            raise LinkError(f"sound:{device}: the stream has stopped; was it unplugged?")

    def close() -> None:
        stream.abort()
        stream.close()

    until_s = time.monotonic() + _STARTING_S
    while not blocks:
        if time.monotonic() > until_s:
            close()
            raise LinkError(f"sound:{device}: no samples came within {_STARTING_S:g} s")
        time.sleep(0.005)
    return InsideTransport(converter, f"sound:{rest}", close, alive)

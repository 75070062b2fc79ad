"""``lashbench serve``: a simulated analyser on a wire.

Owns the options of the verb, the ready line and the two signals that end it.
"""

from __future__ import annotations

import json
import signal
from typing import Annotated, Literal

from cyclopts import Parameter

from daq.errors import InputError
from tui.options import Real, UnitName, Whole
from tui.text.output import Injected
from tui.unit_under_test import ratio_of_unit, read_unit

__all__ = ["serve"]

_PORTS = range(65536)


def serve(
    *,
    unit: UnitName,
    ratio: Real | None = None,
    effect: list[str] | None = None,
    tcp: Annotated[Whole | None, Parameter(help="The analyser's language on this port.")] = None,
    prologix_tcp: Annotated[Whole | None, Parameter(help="An adapter on this port.")] = None,
    vxi11: Annotated[Whole | None, Parameter(help="A VXI-11 gateway on this port.")] = None,
    hislip: Annotated[Whole | None, Parameter(help="A HiSLIP gateway on this port.")] = None,
    prologix_pty: bool = False,
    serial_pty: bool = False,
    model: str = "35670A",
    speed: Literal["fast", "realtime"] = "realtime",
    fault: list[str] | None = None,
    seed: Whole = 0,
    noise: Real = 0.5e-3,
    options: str | None = None,
    dialect: Literal["prologix", "ar488", "ar488-late-eoi"] = "prologix",
    console: Injected,
) -> None:
    """Serve a simulated analyser with a gimbal behind it until SIGTERM or SIGINT.

    When ready it prints one JSON line with the addresses on stdout. It listens
    on 127.0.0.1 only.

    Parameters
    ----------
    ratio
        Contribution ratio of stage 1 to the total backlash, 0 to 1; not needed with one stage.
    effect
        Extension of the model, ID:param=value[,param=value]; repeat it for several.
    tcp
        Port of the bare language; 0 picks a free one.
    prologix_tcp
        Port of a Prologix-style bridge; 0 picks a free one.
    vxi11
        Port of a VXI-11 gateway; 0 picks a free one. There is no port mapper.
    hislip
        Port of a HiSLIP gateway; 0 picks a free one.
    prologix_pty
        A Prologix-style adapter on a pseudo-terminal.
    serial_pty
        The instrument's own RS-232 on a pseudo-terminal, where it has one.
    model
        Which instrument, such as SR785 or SAMPLED; a name that is unknown lists those there are.
    speed
        By the clock, or as fast as it can be computed.
    fault
        What shall go wrong, NAME or NAME:key=value[,key=value]; repeat it for several.
    seed
        Start of the random numbers: the same seed gives the same readings on every wire.
    noise
        Noise of each component of a reading averaged over 30 cycles, V.
    options
        What the instrument says is installed.
    dialect
        Which make of adapter; ar488-late-eoi asserts EOI after the last byte.
    """
    ports = {"tcp": tcp, "prologix-tcp": prologix_tcp, "vxi11": vxi11, "hislip": hislip}
    if all(port is None for port in ports.values()) and not prologix_pty and not serial_pty:
        raise InputError(
            f"nothing to serve; give {', '.join(f'--{name} PORT' for name in ports)}, "
            "--prologix-pty or --serial-pty"
        )
    for name, port in ports.items():
        if port is not None and port not in _PORTS:
            raise InputError(f"--{name} {port} is no port; give 0 to 65535, 0 for any free one")
    if not 0.0 <= noise <= 10.0:
        raise InputError(f"--noise {noise} V must be between 0 and 10 V")
    if seed < 0:
        raise InputError(f"--seed {seed} is negative; give 0 or more")
    if options is not None and not _is_plain(options):
        raise InputError(f"--options {options!r} must be a plain list such as 1D2,1D3")

    from sim.effects import parse_effect
    from sim.instrument.serial_line import SerialInstrument
    from sim.models import Bench, model_named
    from sim.response import SteppedServo
    from sim.serve import Server

    kind = model_named(model)
    if serial_pty and not kind.has_serial:
        raise InputError(f"--serial-pty: model {kind.name} cannot be measured with over RS-232")
    if options is not None and not kind.has_options:
        raise InputError(f"--options {options}: model {kind.name} lists no options")
    faults = [kind.parse_fault(text) for text in fault or []]
    effects = tuple(parse_effect(text) for text in effect or [])
    subject = read_unit(unit, console)
    servo = SteppedServo(subject, ratio_of_unit(subject, ratio), effects, seed=seed)
    # The first dwell may compile the engine, for longer than a client waits for a reply.
    servo.dwell(1000.0, 1.0, 0.0, 0, 1)
    servo.rest()
    instrument = kind.build(servo, Bench(seed, noise, options=options, faults=faults))
    with Server(
        instrument,
        realtime=speed == "realtime",
        tcp=tcp,
        prologix_tcp=prologix_tcp,
        vxi11=vxi11,
        hislip=hislip,
        prologix_pty=prologix_pty,
        serial_pty=instrument if serial_pty and isinstance(instrument, SerialInstrument) else None,
        dialect=dialect,
    ) as server:
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: server.stop())
        # One line, not the indented document of other verbs: readers wait for a line.
        console.data(json.dumps(server.addresses))
        console.note(f"serving a simulated {kind.name}; end it with Ctrl-C")
        server.run()


def _is_plain(options: str) -> bool:
    return options.isascii() and options.isprintable() and '"' not in options

"""Files in HP's Standard Data Format, put together byte by byte from its description.

The layout of the records is that of HP 5963-1715, appendix B, version 2.
"""

import struct
from dataclasses import dataclass, field

import numpy as np

HZ = struct.pack(">10sf8b", b"Hz", 6.2831855, 0, 0, -2, 0, 0, 0, 0, 2)
VOLT = struct.pack(">10sf8b", b"V", 1.0, 2, 4, -6, -2, 0, 0, 0, 0)
HP_35670A, HP_35665A = 10, 2


@dataclass(frozen=True)
class Channel:
    label: bytes = b"Chan  1"
    window: float = 1.0
    unit: float = 1.0
    overloaded: int = 0

    def record(self) -> bytes:
        return struct.pack(
            ">hll30s12s12s2h5fhffhhhh10s22sffhhh5d",
            14,
            192,
            -1,
            self.label,
            b"HP35670A",
            b"MY1",
            *(1, 1, 1.0, 0.0, 0.0, 1.0, self.window),
            *(0, 0.0, 0.0, 3, 1, 0, self.overloaded),
            *(b"V", VOLT, self.unit, 1e6, 0, 1, 0),
            *(1.0, 0.0, 0.0, 0.0, 0.0),
        )


@dataclass(frozen=True)
class File:
    """A saved trace; the defaults are a frequency response with linear spacing."""

    gain: tuple = (0.5 + 0.25j, 0.25 - 0.5j, -1 + 0.125j, 2j)
    application: int = HP_35670A
    revision: int = 2
    title: bytes = b""
    data_type: int = 4
    is_complex: int = 1
    is_valid: int = 1
    x_type: int = 0
    first: float = 100.0
    step: float = 2.5
    x_unit: bytes = HZ
    y_code: int = 3
    rows: int = 1
    points: int | None = None
    span: tuple = (0, 3)
    powers: tuple = (48, -48)
    records: tuple = (1, 0)
    channels: tuple = field(default=(Channel(), Channel(b"Chan  2")))
    abscissa: tuple | None = None

    def content(self) -> bytes:
        points = len(self.gain) if self.points is None else self.points
        measurement = struct.pack(
            ">hll8slh2hhlf60sf3dhhhd",
            *(11, 140, -1, b"", len(self.gain), 1, *self.span, 0, 0, 0.0),
            *(self.title, 0.0, 105.0, 10.0, 0.0, 2, 0, 0, 0.0),
        )
        data = struct.pack(
            ">hll16shh2h8sh2hhhhhhhl2h22sh22s2dhh",
            *(12, 134, -1, b"Freq Resp", 0, self.data_type, points, points - 1, b""),
            *(self.x_type, 4, 0, self.y_code, 1, self.is_complex, 0, 0, self.is_valid),
            *(0, self.rows, 1, self.x_unit, 0, VOLT, self.first, self.step, 0, 0),
        )
        vector = struct.pack(">hll2h2h", 13, 18, -1, *self.records, *self.powers)
        channels = b"".join(channel.record() for channel in self.channels)
        scan = struct.pack(">hl4h22s4x", 15, 40, 1, 0, 0, 3, VOLT)
        kind = ">c8" if self.y_code == 3 else ">c16"
        values = np.array(self.gain, dtype=kind if self.is_complex else ">f4").tobytes()
        y = struct.pack(">hl", 17, 6 + len(values)) + values
        x = b""
        if self.abscissa is not None:
            numbers = np.array(self.abscissa, dtype=">f8").tobytes()
            x = struct.pack(">hl", 16, 6 + len(numbers)) + numbers
        start = 2 + 64 + len(measurement)
        places = np.cumsum([start, len(data), len(vector), len(channels), len(scan), len(x)])
        header = struct.pack(
            ">hlhhhhh8s6h7l",
            *(10, 64, self.revision, self.application, 2026, 1121, 1234, b"A.01.11"),
            *(1, 1, len(self.channels), 0, 1, 1 if x else 0),
            *(places[0], places[1], places[2], -1, places[3], places[4] if x else -1, places[5]),
        )
        return b"B\x00" + header + measurement + data + vector + channels + scan + x + y

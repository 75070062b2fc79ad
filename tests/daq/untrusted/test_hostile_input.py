"""Everything that reads what others wrote: nothing crashes, hangs or fills the memory.

`make fuzz` does the same a million times, guided by coverage.
"""

import time
import tracemalloc
from pathlib import Path

import pytest
from foreign_files import dtt_xml, universal_58
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from worlds.fuzz_targets import seeds, targets

from daq.errors import ConfigurationError, FileFormatError
from daq.formats import read_response
from daq.limits import load_bench
from daq.transports.transcript import Replay
from sim.unit import load_unit

SLOW = ("hdf5", "history", "analyser", "adapter", "prologix")
APART = ("mat", "foreign-mat", "foreign-h5", "record-mat")
"""Each example takes a child process."""
NAMES = (
    "csv", "hdf5", "uff", "mat", "sdf", "unit", "bench", "recipe", "transcript", "history",
    "block", "replies", "address", "prologix", "analyser", "adapter",
    "text", "guess", "dtt", "foreign-uff", "foreign-mat", "foreign-h5",
    "record", "record-mat", "record-wav",
)  # fmt: skip
DEEP, BIG = b"[" * 100_000, b"9" * 5000
TOML = (
    b"a = " + DEEP, b"a = " + BIG, b"a = " + b"{a=" * 50_000, b"a" + b".a" * 20_000 + b" = 1",
    b"[" + b"a." * 20_000 + b"a]", b"d = 2026-13-45", b"a = " + b"[" * 40 + b"]" * 40,
    b"a = {a" + b".a" * 500_000 + b" = 1}", b'\\"' * 400_000, b'"a=".' * 100_000 + b"a = 1",
)  # fmt: skip
JSON = (DEEP, b'{"a":' * 100_000, b'{"act": "poll", "gave": ' + BIG + b"}", b"[" * 40 + b"]" * 40)
TABLES = [
    mark * 300_000 + b"\n1,2,3\n2,3,4\n"
    for mark in (b"x", b"(", b"1", b"1,", b'"', b"[a ", b"a (", b"\t", b" ", b"+1e5", b"dB(1dB,")
] + [
    b"f\tx\n" + b"(1dB,2" * 50_000,
    b"1\t" + b"1.1e+1," * 50_000,
    b"1 2\n" * 200_000,
    b"%a\n" * 200_000,
]
HOSTILE = {
    "text": TABLES,
    "guess": TABLES,
    "foreign-uff": [
        b"    -1\n" * 100_000,
        b"    -1\n    58\n" + b"x\n" * 200_000,
        b"    -1\n    58b     1     2          11  2000000000\n" + b"x\n" * 20,
        universal_58().replace(b"       181", b"   3999999"),
    ],
    "dtt": [
        b"<LIGO_LW>" * 20_000,
        b"<LIGO_LW " + b"a='1' " * 100_000,
        dtt_xml().replace(b">181<", b">3999999<"),
    ],
    "csv": [b"# " + line for line in TOML] + [b"x" * 1_000_000],
    "unit": TOML,
    "bench": TOML,
    "recipe": TOML,
    "transcript": [b'{"transcript": 1}\n' + line + b"\n" for line in JSON],
    "replies": [BIG, b"+" + BIG + b',"x"', b"1" * 100_000 + b"E5", b'"' * 100_001],
    "block": [b"#91000000000x", b"#9999999999", b"#9" + b"\xb2" * 9],
    "address": [b"sim:?seed=" + BIG, b"GPIB0::" + BIG + b"::INSTR", b"prologix-tcp:[::1:99"],
    "analyser": [b"FREQ:STAR " + BIG, b"TRAC:DATA D1,#9999999999", b"(" * 5000, b"*SRE " + BIG],
    "adapter": [b"++addr " + BIG + b"\n", b"++read_tmo_ms " + BIG + b"\n", b"++read " + BIG],
}


@pytest.fixture(scope="module")
def readers():
    with targets() as found:
        assert sorted(found) == sorted(NAMES)
        yield found


def damaged(data, whole: bytes) -> bytes:
    """Part of it cut out, turned over, repeated, or something else put in."""
    content = bytearray(whole)
    for _ in range(data.draw(st.integers(0, 4))):
        start = data.draw(st.integers(0, len(content)))
        end = min(len(content), start + data.draw(st.integers(0, 60)))
        piece = data.draw(st.one_of(st.binary(max_size=20), st.just(bytes(content[start:end] * 2))))
        content[start:end] = piece
    return bytes(content)


@pytest.mark.parametrize("name", NAMES)
def test_any_bytes_raise_only_reader_errors(readers, name):
    whole = seeds(name)

    @settings(
        max_examples=2 if name in APART else 4 if name in SLOW else 20,
        deadline=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(st.data())
    def check(data):
        readers[name](damaged(data, data.draw(st.sampled_from(whole))))

    check()


@pytest.mark.parametrize("name", HOSTILE)
def test_parser_exhausting_text_is_refused(readers, name):
    for content in HOSTILE[name]:
        began = time.process_time()
        readers[name](content)
        assert time.process_time() - began < 5.0, content[:40]


def test_huge_block_is_refused_before_allocation(readers):
    tracemalloc.start()
    try:
        for header in (b"#91000000000", b"#9999999999", b"#71048577"):
            readers["block"](header + b"x" * 100)
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("name", "read", "error"),
    [
        ("unit.toml", lambda path: load_unit(str(path)), ConfigurationError),
        ("bench.toml", lambda path: load_bench(str(path)), ConfigurationError),
        ("x.csv", read_response, FileFormatError),
        ("x.h5", read_response, FileFormatError),
        ("x.jsonl", Replay, FileFormatError),
    ],
)
def test_a_file_without_an_end_is_refused(tmp_path, name, read, error):
    path = tmp_path / name
    path.symlink_to(Path("/dev/zero"))
    with pytest.raises(error):
        read(path)

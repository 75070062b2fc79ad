"""What was compiled is kept, known again, and never half of it run."""

from __future__ import annotations

import ctypes

import pytest

from sim.engine import machine_code

# Writes 2 a[0] into a[0], in the form that the kernel has.
PROGRAM = """
define void @step(double* %a, double* %b, double* %c, i64 %d, i64 %e, i64 %f, double* %g) {
  %one = load double, double* %a
  %two = fmul double %one, 2.0
  store double %two, double* %a
  ret void
}
"""


@pytest.fixture
def written(monkeypatch, tmp_path):
    """A cache of its own; how often a program was written."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return []


def doubled(source, written, name="double", program=PROGRAM):
    def write():
        written.append(name)
        return program

    number = ctypes.c_double(21.0)
    place = ctypes.addressof(number)
    machine_code.compiled(name, [source], write)(place, place, place, 0, 0, 0, place)
    return number.value


def test_program_is_recompiled_only_after_change(written, tmp_path):
    source, other = tmp_path / "law.py", tmp_path / "other.py"
    source.write_text("one")
    other.write_text("another")
    assert [doubled(source, written) for _ in range(3)] == [42.0] * 3
    assert len(written) == 1
    assert doubled(source, written, "again") == 42.0
    assert doubled(other, written) == 42.0
    assert len(written) == 3
    assert len(list(machine_code.code_folder().glob("*.code"))) == 3


@pytest.mark.parametrize("damage", [lambda kept: kept[:-1], lambda kept: b"", lambda kept: kept[:9],
                                    lambda kept: kept[:33] + b"e" + kept[34:]])  # fmt: skip
def test_damaged_code_is_recompiled_not_run(written, tmp_path, damage):
    source = tmp_path / "law.py"
    source.write_text("one")
    doubled(source, written)
    (file,) = machine_code.code_folder().glob("*.code")
    whole = file.read_bytes()
    assert damage(whole) != whole
    file.write_bytes(damage(whole))
    assert doubled(source, written) == 42.0
    assert len(written) == 2
    assert file.read_bytes() == whole


def test_unwritable_folder_only_costs_time(written, tmp_path, monkeypatch):
    source = tmp_path / "law.py"
    source.write_text("one")
    monkeypatch.setenv("XDG_CACHE_HOME", str(source))
    assert doubled(source, written) == 42.0
    assert doubled(source, written) == 42.0
    assert len(written) == 2


@pytest.mark.parametrize(("mode", "gives"), [(0o755, 63.0), (0o777, 42.0)])
def test_code_others_may_have_written_never_runs(written, tmp_path, mode, gives):
    source, other = tmp_path / "law.py", tmp_path / "other.py"
    source.write_text("one")
    other.write_text("another")
    assert doubled(source, written) == 42.0
    (mine,) = machine_code.code_folder().glob("*.code")
    assert doubled(other, written, program=PROGRAM.replace("2.0", "3.0")) == 63.0
    (theirs,) = set(machine_code.code_folder().glob("*.code")) - {mine}
    mine.write_bytes(theirs.read_bytes())
    machine_code.code_folder().chmod(mode)
    assert doubled(source, written) == gives

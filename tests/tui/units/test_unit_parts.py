"""new-unit: sections that a drive may have besides, asked for or written as comments."""

import itertools
import re
import tomllib

import pytest

from daq.configs import config_path
from daq.errors import InputError
from sim.datasheet import find_impossible
from sim.drivetrain import paper_drivetrain
from sim.unit import unit_from_mapping
from tui import cli
from tui.unit_questions import ask_for_values
from tui.units import ask_parts, with_parts

NAMES = ("amplifier", "sensor", "sampling", "motor_coupling", "load_coupling", "damping", "loop")


def template(name):
    return config_path("templates", name).read_text(encoding="utf-8")


def asked(answers):
    said, lines = [], iter(answers)
    return ask_parts(said.append, lambda: f"{next(lines, 'no')}\n"), "".join(said)


def test_drive_of_paper_kind_needs_one_question():
    names, said = asked(["no"])
    assert names == ()
    assert said.count("[yes / no]") == 1


def test_each_part_is_asked_until_valid():
    names, said = asked(["y", "no", "maybe", "yes", "Y", "n", "yes", "-"])
    assert names == ("sensor", "sampling", "load_coupling")
    assert "'maybe' is neither yes nor no" in said
    with pytest.raises(InputError, match="nothing was written"):
        ask_parts(lambda text: None, lambda: "")


@pytest.mark.parametrize("stages", ["one-stage", "two-stage", "three-stage"])
def test_every_choice_of_parts_makes_a_unit(stages):
    for count in range(len(NAMES) + 1):
        for names in itertools.combinations(NAMES, count):
            text = with_parts(template(stages), template("parts"), names)
            unit = unit_from_mapping(tomllib.loads(text), "parts")
            assert not find_impossible(unit), names
            paper_drivetrain(unit, 1.0).system()
            has = {name for name in NAMES if getattr(unit, name) is not None}
            assert has == {*names, *(["sampling"] if "sensor" in names else [])}
            if "sensor" in names:
                assert unit.sampling.holds_command == bool({"sampling", "loop"} & set(names))


@pytest.mark.parametrize("stages", ["one-stage", "two-stage", "three-stage"])
def test_every_kind_of_loop_makes_a_unit(stages):
    for more in ((), ("position",), ("command",), ("position", "command")):
        for beside in ((), ("sampling",), ("amplifier", "sampling")):
            names = (*beside, *(["sensor"] if "position" in more else []), "loop", *more)
            unit = unit_from_mapping(
                tomllib.loads(with_parts(template(stages), template("parts"), names)), "parts"
            )
            assert not find_impossible(unit), names
            assert (unit.loop.controls == "position") == ("position" in more)
            assert unit.loop.computing_s == (5e-4 if "sensor" in names else None)
            assert unit.sensor is None or unit.sensor.delay_s is None
            assert (unit.loop.excited == "command") == ("command" in more)


def test_loop_is_asked_for_what_it_is():
    names, _ = asked(["y", "n", "y", *"nnnnn", "y", "y", "y"])
    assert names == ("sensor", "loop", "position", "command")
    # A tachometer reads no position.
    names, said = asked(["y", *"nnnnnnnnn", "y", "n"])
    assert names == ("loop",)
    assert "position loop is around" not in said


def test_part_values_use_catalogue_units():
    text = with_parts(template("two-stage"), template("parts"), ("amplifier", "sensor"))
    said = []
    answers = {"bandwidth_hz": "1.2 kHz", "delay_s": "0.25 ms", "counts": "16384", "k_a": "0.5"}

    def read():
        last = said[-1].split(":", 1)[0].strip()
        return answers.get(last, "-") + "\n"

    unit = unit_from_mapping(tomllib.loads(ask_for_values(text, said.append, read)), "asked")
    assert unit.amplifier.bandwidth_hz == 1200.0
    assert unit.sensor.delay_s == pytest.approx(2.5e-4)
    assert unit.sensor.counts == 16384.0
    assert unit.electronics.k_a == 0.5
    assert not any(one.startswith(("R_m", "corner_hz")) for one in said)


@pytest.mark.parametrize(
    ("name", "given", "k_ts"),
    [("accelerometer", "100 mV/g", 0.0101972), ("motor_current", "400 mV/A", 0.4)],
)
def test_sensor_gain_is_asked_in_its_units(name, given, k_ts):
    text = with_parts(template("one-stage"), template("parts"), (name, "damping"))
    said = []

    def read():
        asks = said[-1].split(":", 1)[0].strip()
        if asks == "k_ts" and "is no unit of k_ts" not in "".join(said):
            return "0.4 V/krpm\n"
        return {"k_ts": given, "radius_m": "50 mm"}.get(asks, "-") + "\n"

    unit = unit_from_mapping(tomllib.loads(ask_for_values(text, said.append, read)), "asked")
    assert unit.electronics.k_ts == pytest.approx(k_ts, rel=1e-4)
    assert unit.electronics.filter_numerator is None
    assert unit.sensor.kind == name.removeprefix("motor_")
    assert unit.sensor.radius_m == (0.05 if name == "accelerometer" else None)
    assert not find_impossible(unit)
    assert "k_acc" not in "".join(said)


def test_one_sensor_is_asked_for():
    names, said = asked(["y", "no", "no", "yes"])
    assert names == ("accelerometer",)
    assert "current is read" not in said
    # A torque drive's current tells nothing.
    assert "motor's current" not in asked(["y", "yes", "no"])[1]


@pytest.mark.parametrize("stages", ["1", "2", "3"])
def test_commented_parts_of_new_file_work(stages, tmp_path, capsys):
    path = tmp_path / "own.toml"
    assert cli.main(["new-unit", "--out", str(path), "--stages", stages]) == 0
    capsys.readouterr()
    head, parts = path.read_text(encoding="utf-8").split("[tolerance]", 1)
    uncommented = re.sub(r"(?m)^# (\[|\w+ = )", r"\1", parts.split("besides", 1)[1])
    mended = re.sub(r"(?m)^(L_a|R_m|k_b) = .*\n", "", head) + uncommented.split(":", 1)[1]
    path.write_text(mended, encoding="utf-8")
    assert cli.main(["new-unit", "--check", str(path)]) == 0
    told = capsys.readouterr().out
    assert "controls the current" in told
    assert "encoder at the motor" in told


@pytest.mark.parametrize("stages", ["one-stage", "two-stage", "three-stage"])
def test_efficiency_is_asked_in_per_cent(stages):
    text = with_parts(template(stages), template("parts"), ("efficiency",))
    said = []

    def read():
        return {"eta_1": "45 %"}.get(said[-1].split(":", 1)[0].strip(), "-") + "\n"

    unit = unit_from_mapping(tomllib.loads(ask_for_values(text, said.append, read)), "asked")
    assert unit.stage1.eta_1 == 0.45
    assert unit.stage2 is None or unit.stage2.eta_2 == 0.9

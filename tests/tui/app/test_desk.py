"""The desk of the bench screen: with which unit a stored measurement is opened."""

from dataclasses import replace

import pytest
from instruments.measuring import measuring
from outputs.screen import operated
from outputs.screen import run as run_screen

from daq.configs import config_path, sample_path
from daq.errors import ConfigurationError, InputError
from daq.formats import read_response
from daq.plan import SweepPlan
from daq.store import Store
from sim.unit import load_unit, unit_from_mapping
from tui.app.screens.result_screen import answer_lines
from tui.app.state.desk import Desk, Results

SHIPPED = load_unit("adss")


@pytest.fixture
def measured(run, db, tmp_path):
    """Measure with an own unit file, which is gone afterwards; the measurement and that text."""

    def measure(name, *words):
        text = config_path("units", "adss").read_text(encoding="utf-8")
        for old, new in (
            ('name = "ADSS"', f'name = "{name}"'),
            ("J_L = 2.75e-3", "J_L = 5.0e-3"),
            ("source_vpk = 5.0", "source_vpk = 3.0"),
        ):
            assert text.count(old) == 1
            text = text.replace(old, new)
        file = tmp_path / "own.toml"
        file.write_text(text, encoding="utf-8")
        assert run(*measuring(*words, unit=file))[0] == 0
        file.unlink()
        with Store(db, read_only=True) as store:
            return store.measurements()[-1], text

    return measure


def with_unit_text(measurement, text):
    header = replace(measurement.header, configurations={} if text is None else {"unit": text})
    return replace(measurement, header=header)


@pytest.mark.parametrize("name", ["ADSS", "gär"])
def test_measurement_opens_with_its_unit_file(measured, db, name):
    measurement, text = measured(name, "--serial", "7")
    desk = Desk(db)
    desk.choose_unit_of(measurement)
    assert (desk.unit.name, desk.serial) == (name, "7")
    assert (desk.unit.load.J_L, desk.unit.limits.source_vpk) == (5.0e-3, 3.0)
    assert desk.recipe is None
    # A new sweep of it is of that unit, too.
    request = desk.request()
    assert request.header.unit == name
    assert request.header.configurations["unit"] == text
    assert min(limits.source_vpk for limits in request.limits) == 3.0
    desk.choose_unit("adss")
    assert (desk.unit, desk.recipe) == (SHIPPED, "adss")
    assert "2.75e-3" in desk.request().header.configurations["unit"]


def test_origin_tells_units_of_one_name_apart(measured, db, tmp_path):
    _, text = measured("ADSS")
    own, same = tmp_path / "own.toml", tmp_path / "same.toml"
    own.write_text(text.replace("R_m = 4.10", "R_m = 4.5"), encoding="utf-8")
    same.write_bytes(config_path("units", "adss").read_bytes())
    desk = Desk(db)
    desk.choose_unit(str(own))
    differs = "differs from the shipped one: R_m, J_L, source_vpk"
    assert desk.unit_origin == f"{own}\n{differs}"
    desk.choose_unit(str(same))
    assert desk.unit_origin == f"{same}\nas the shipped ADSS"
    desk.choose_unit("ADSS")
    assert (desk.unit_origin, desk.unit_name, desk.recipe) == ("", "adss", "adss")

    async def way():
        async with operated(db) as op:
            units = op.app.screen.query_one("#units")
            assert units.highlighted == 0
            assert "differs" not in op.screen
            await op.press("7", "u", "enter")
            await op.sees("[5 Result]")
            await op.press("1")
            await op.sees(
                "unit of measurement 1", "differs from the shipped one: J_L,", "source_vpk"
            )
            assert units.highlighted is None
            units.focus()
            await op.press("down")
            assert "differs" not in op.screen
            assert op.app.desk.unit == SHIPPED

    run_screen(way)


def test_shipped_unit_keeps_its_recipe(run, db):
    run(*measuring())
    with Store(db, read_only=True) as store:
        measurement = store.measurement(1)
    for one in (measurement, with_unit_text(measurement, None)):
        desk = Desk(db)
        desk.choose_unit_of(one)
        assert (desk.unit_name, desk.unit, desk.recipe) == ("adss", SHIPPED, "adss")


def test_unit_missing_from_history_changes_nothing(measured, db):
    measurement, text = measured("gär", "--serial", "7")
    desk = Desk(db)
    desk.choose_unit("edss")
    for gone, said in ((None, "'gär' has no file in the history"), ("[", "is not valid TOML")):
        with pytest.raises(ConfigurationError, match=said):
            desk.choose_unit_of(with_unit_text(measurement, gone))
    assert (desk.unit.name, desk.serial) == ("EDSS", "")


def test_resuming_keeps_notes_and_refuses_changes(measured, db):
    measurement, _ = measured("gär", "--operator", "anna", "--notes", "one", "--serial", "7")
    desk = Desk(db, operator="bob", serial="7")
    assert desk.take_up(measurement) == (
        "measurement 1 keeps its own operator; yours were left out"
    )
    assert (desk.serial, desk.operator, desk.notes) == ("7", "anna", "one")
    assert desk.request().resume == desk.remarks_of == 1
    for name, stored in (("operator", "anna"), ("notes", "one"), ("serial", "7")):
        setattr(desk, name, "8")
        with pytest.raises(InputError, match=f"{name} '8' was given and it has '{stored}'"):
            desk.request()
        setattr(desk, name, stored)
    desk.begin_anew()
    desk.operator = "bob"
    assert desk.remarks_of is None
    assert desk.request().header.operator == "bob"


def test_remarks_change_only_for_new_measurements(run, db):
    assert run(*measuring("--operator", "anna", "--serial", "7"))[0] == 0
    with Store(db) as store:
        store.reopen(1)

    async def way():
        async with operated(db) as op:
            fields = [
                op.app.screen.query_one(f"#{name}") for name in ("serial", "operator", "notes")
            ]
            await op.types("#operator", "bob")
            op.app.screen.query_one("#sessions").focus()
            await op.press("enter")
            await op.sees("[2 Instrument]", "measurement 1 keeps its own", "operator; yours were")
            await op.goes_to(1)
            await op.sees("session 1 keeps them as they are", "Enter on a unit: a new measurement")
            assert [field.value for field in fields] == ["7", "anna", ""]
            assert all(field.disabled for field in fields)
            fields[2].value = "late"
            await op.pilot.pause()
            assert (op.app.desk.resume, op.app.desk.notes) == (1, "")
            op.app.screen.query_one("#units").focus()
            await op.press("enter")
            assert not any(field.disabled for field in fields)
            assert "keeps them as they are" not in op.screen
            assert op.app.desk.resume is None

    run_screen(way)


def test_plan_beyond_analyser_settings_is_refused(db):
    desk = Desk(db)
    desk.choose_unit("adss")
    desk.given_plan = SweepPlan((100.0, 100.005, 110.0), (2.0,))
    with pytest.raises(InputError, match="100 and 100.005 Hz would both be measured at 100 Hz"):
        desk.request()


def test_stored_unit_is_measured_anew_on_screen(measured, db):
    _, text = measured("gär")

    async def way():
        async with operated(db, (120, 40)) as op:
            await op.press("7", "u", "enter")
            await op.sees("[5 Result]", "r = 0.310")
            await op.press("2")
            await op.connects("sim:")
            await op.plans(start="125", stop="150", points="6")
            await op.checks()
            await op.press("ctrl+n", "s")
            await op.sees("6 of 6 points stored; complete")

    run_screen(way)
    with Store(db, read_only=True) as store:
        header = store.measurement(2).header
    assert (header.unit, header.configurations["unit"]) == ("gär", text)


def test_doubtful_response_passes_no_stage():
    whole = read_response(sample_path("adss-sweep"))
    cut = replace(whole, provenance={**whole.provenance, "state": "interrupted"})
    content = load_unit("adss").model_dump(by_alias=True)
    content["limits"]["b1_deg"] = 9.0
    unit = unit_from_mapping(content, "test")
    estimate = {"contribution_ratio": {"value": 0.3, "std": 0.01}, "refuted": False}
    estimate |= {"b1_deg": {"value": 0.2, "std": 0.01}, "b2_deg": {"value": 0.05, "std": 0.01}}
    for results, said in [
        (Results(response=whole), "Stage 1: PASS"),
        (Results(response=cut), "Stage 1: UNDECIDED"),
        (Results(response=whole, as_is=True), "Stage 1: UNDECIDED"),
    ]:
        lines = answer_lines(estimate, None, unit, results.doubt)
        assert any(line.startswith(said) for line in lines), lines

"""The unit step of the screen tells what is unusual in a file, and refuses what cannot be."""

from outputs.screen import operated, run

from daq.configs import config_path


def test_unit_step_reports_unusual_values(tmp_path):
    text = config_path("templates", "two-stage").read_text(encoding="utf-8")
    odd, wrong = tmp_path / "odd.toml", tmp_path / "wrong.toml"
    odd.write_text(text.replace("b_t_deg = 0.12", "b_t_deg = 7.2"), encoding="utf-8")
    wrong.write_text(text.replace("k_t = 4.6e-2", "k_t = 46.0"), encoding="utf-8")

    async def way():
        async with operated(tmp_path / "bench.db") as op:
            await op.types("#file", str(odd))
            await op.press("enter")
            await op.sees("7.2 deg", "arcmin")
            assert op.app.desk.unit.backlash.b_t_deg == 7.2
            await op.types("#file", str(wrong))
            await op.press("enter")
            await op.sees("values that cannot be")
            assert op.app.desk.unit.backlash.b_t_deg == 7.2

    run(way)

"""The page on effects lists the catalogue as it is."""

from pathlib import Path

from sim.catalogue import BUILT_IN

PAGE = Path(__file__).parents[2] / "docs" / "effects.md"


def test_page_lists_every_effect_with_parameters():
    rows = [line.split("|") for line in PAGE.read_text().splitlines() if line.startswith("| ")]
    listed = {row[1].strip(): row for row in rows[2:]}
    assert list(listed) == list(BUILT_IN)
    for identifier, effect in BUILT_IN.items():
        row = listed[identifier]
        assert [f"`{p.name}` [{p.unit_symbol}]" for p in effect.parameters] == [
            cell.strip() for cell in row[2].split(",")
        ]
        assert row[3].strip() == effect.site
        assert row[4].strip() == effect.meaning
        assert row[5].strip() == effect.bench_cause
        assert row[6].strip() == effect.check

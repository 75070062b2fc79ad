"""The readability check: the documentation passes, and each kind of offender is found."""

from pathlib import Path

import pytest
from readability import DOCUMENTATION_WORDS, offences

ROOT = Path(__file__).parents[1]
GOOD = "# A title\n\nAll is off. `The hunt purse` is code.\n\n| a | b |\n| - | - |\n| 1 | 2 |\n"


def project(folder, page=GOOD, docstring="Owns one thing."):
    (folder / "docs").mkdir()
    (folder / "CONTRIBUTING.md").write_text("# Work\n\nIt is tested.\n")
    (folder / "README.md").write_text("# A name\n\nIt measures. It reads. It stops. It ends.\n")
    (folder / "docs" / "page.md").write_text(page)
    (folder / "analysis").mkdir()
    (folder / "analysis" / "module.py").write_text(f'"""{docstring}"""\n')
    return folder


def test_the_documentation_reads_plainly():
    assert offences(ROOT) == []


def test_a_plain_project_passes(tmp_path):
    assert offences(project(tmp_path)) == []


@pytest.mark.parametrize(
    ("page", "found"),
    [
        ("Then " + "very " * 40 + "long.\n", "docs/page.md: 42 words"),
        ("| a |\n| - |\n| " + "very " * 41 + "long |\n", "docs/page.md: 42 words"),
        ("- A list. Very " + "very " * 39 + "long\n", "docs/page.md: 41 words"),
        ("The hunt goes on.\n", "docs/page.md: banned: 'hunt'"),
        ("| a |\n| - |\n| Whoever leads |\n", "docs/page.md: banned: 'Whoever leads'"),
        ("See [the Atlas](page.md).\n", "docs/page.md: banned: 'Atlas'"),
        (("Word " + "word " * 17 + "ends. ") * 9, "docs: the median sentence has 19 words"),
        (("One two. " * (DOCUMENTATION_WORDS // 2 + 1)), "docs: 45002 words"),
    ],
)
def test_an_offending_page_is_found(tmp_path, page, found):
    (line,) = offences(project(tmp_path, page))
    assert line.startswith(found)


def test_an_offending_docstring_is_found(tmp_path):
    found = offences(project(tmp_path, docstring="Owns the purse."))
    assert found == ["analysis/module.py: banned: 'purse'"]


def test_private_and_generated_text_is_exempt(tmp_path):
    folder = project(tmp_path)
    (folder / "docs" / "api.md").write_text("Whoever leads.\n")
    (folder / "analysis" / "other.py").write_text('def _spend():\n    """Spend the purse."""\n')
    assert offences(folder) == []

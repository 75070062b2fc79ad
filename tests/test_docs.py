"""The documentation: links lead somewhere, and what is quoted can be run."""

from pathlib import Path

from links import broken_links

ROOT = Path(__file__).parents[1]


def test_every_link_of_the_documentation_leads_somewhere():
    assert broken_links(ROOT) == []


def test_the_link_checker_finds_what_is_broken(tmp_path):
    (tmp_path / "docs").mkdir()
    (tmp_path / "picture.png").write_bytes(b"")
    (tmp_path / "README.md").write_text(
        "# The `first` steps\n"
        "[ok](docs/page.md) [ok](docs/page.md#a-heading) [ok](#the-first-steps) ![ok](picture.png)"
        " [ok](https://example.org) [ok](docs)\n"
        "[bad](gone.md) [bad](docs/page.md#gone) [bad](#gone) ![bad](gone.png) [bad](../../etc)\n"
        "`[no link](gone.md)`\n"
    )
    (tmp_path / "docs" / "page.md").write_text("## A heading\n[bad](README.md)\n")
    assert broken_links(tmp_path) == [
        "README.md: gone.md",
        "README.md: docs/page.md#gone",
        "README.md: #gone",
        "README.md: gone.png",
        "README.md: ../../etc",
        "docs/page.md: README.md",
    ]

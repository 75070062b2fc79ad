"""The documentation: links lead somewhere, and what is quoted can be run."""

import ast
import re
import runpy
import shutil
import sys
from importlib import import_module
from pathlib import Path

import api_page
import pytest
from links import broken_links
from outputs.printed import Newcomer, mentions, pages, pieces, stocked_history

from daq.analyser import SourceState
from daq.plan import SweepPlan
from daq.store import Store
from daq.store_records import MeasurementHeader
from sim.catalogue import BUILT_IN
from tui import cli

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.py"))
ELSEWHERE = {"docs/instrument.md"}
"""Pages whose Python is run by a test of its own, with arguments."""


def test_every_documentation_link_resolves():
    assert broken_links(ROOT) == []


def test_link_checker_finds_broken_links(tmp_path):
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


def name_of(page):
    return str(page.relative_to(ROOT))


@pytest.fixture(scope="module")
def history(tmp_path_factory):
    path = tmp_path_factory.mktemp("history") / "lashbench.db"
    stocked_history(path)
    return path


@pytest.mark.parametrize("page", pages(), ids=name_of)
def test_everything_printed_on_a_page_runs(page, history, tmp_path, monkeypatch):
    printed = list(pieces(page))
    if name_of(page) in ELSEWHERE:
        printed = [piece for piece in printed if piece[0] == "command"]
    if not printed:
        return
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    (tmp_path / "data" / "lashbench").mkdir(parents=True)
    if any("--resume 12" in text for _, text in printed):
        shutil.copy(history, tmp_path / "data" / "lashbench")
    folder = tmp_path / "folder"
    folder.mkdir()
    monkeypatch.chdir(folder)
    with Newcomer(folder) as newcomer:
        said = ""
        for kind, text in printed:
            if kind == "printed":
                assert said == text
            else:
                said = newcomer.run(kind, text)


@pytest.mark.parametrize("page", pages(), ids=name_of)
def test_commands_in_running_text_have_these_options(page, capsys):
    for mention in mentions(page):
        verb, options = mention.split()[1], re.findall(r" (--[a-z][a-z-]*)", mention)
        if verb.startswith("--"):
            continue
        assert verb in cli.VERBS, mention
        assert cli.main([verb, "--help"]) == 0
        known = set(re.findall(r"--[a-z][a-z-]*", capsys.readouterr().out))
        assert set(options) <= known, mention


def test_page_with_failing_command_is_found(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    wrong = (
        "lashbench simulat --unit adss",
        "lashbench measure --unit adss --instrument sim: --level 99 --start 100 --stop 180 "
        "--points 3",
        "lashbench estimate gone.csv --unit adss",
        "lashbench report 1 --unit adss --output report.html",
        "lashbench measure --unit adss --instrument prologix: --recipe adss",
        "make coffee",
        "python docs/examples/gone.py",
    )
    for line in wrong:
        folder = tmp_path / str(wrong.index(line))
        folder.mkdir()
        with Newcomer(folder) as newcomer, pytest.raises(Exception, match="."):
            newcomer.run("command", line)
    (tmp_path / "page.md").write_text(
        "```\nlashbench extract \\\n  x.csv # a\n```\n\n    make test\n"
    )
    assert [text for _, text in pieces(tmp_path / "page.md")] == [
        "lashbench extract x.csv # a",
        "make test",
    ]


def test_interface_page_matches_the_code():
    assert api_page.page() == api_page.PAGE.read_text(), "run python tests/api_page.py"


def test_every_public_name_has_docstring():
    for line in api_page.page().splitlines():
        assert not line.rstrip().endswith("`:"), line


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_is_short_and_uses_public_names(example):
    text = example.read_text(encoding="utf-8")
    assert len(text.splitlines()) < 50
    public = {
        module.__name__: module.__all__
        for floor in api_page.FLOORS
        for module in api_page.public_modules(import_module(floor))
    }
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] in api_page.FLOORS:
            assert {alias.name for alias in node.names} <= set(public[node.module]), node.module


@pytest.mark.parametrize("page", pages(), ids=name_of)
def test_files_named_on_page_exist(page):
    for path in re.findall(r"`((?:daq|sim|analysis|tui|tests)/[\w./*]+)`", page.read_text()):
        assert list(ROOT.glob(path.rstrip("/"))), path


def test_the_table_of_verbs_is_whole():
    page = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    table = page[page.index("## Commands") : page.index("| exit code |")]
    assert sorted(re.findall(r"^\| `([a-z-]+)`", table, re.MULTILINE)) == sorted(cli.VERBS)


def test_every_page_is_linked_from_index():
    reached, waiting = set(), [ROOT / "docs" / "index.md"]
    while waiting:
        page = waiting.pop()
        if page in reached or page.suffix != ".md":
            continue
        reached.add(page)
        targets = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
        waiting += [(page.parent / target).resolve() for target in targets]
    assert set(pages()) - {ROOT / "README.md"} <= reached


def test_architecture_lists_every_decision_by_title():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    listed = re.findall(r"^- \[(\d+\. .+)\]\(decisions/(.+\.md)\)$", page, re.MULTILINE)
    records = sorted((ROOT / "docs" / "decisions").glob("[0-9]*.md"))
    assert [name for _, name in listed] == [file.name for file in records]
    for (title, _), file in zip(listed, records, strict=True):
        assert file.read_text(encoding="utf-8").startswith(f"# {title}\n")


def test_decision_record_has_usual_parts_under_limit():
    parts = ["Status", "Context", "Decision", "Evidence", "Consequences"]
    for file in sorted((ROOT / "docs" / "decisions").glob("[0-9]*.md")):
        text = file.read_text(encoding="utf-8")
        assert re.findall(r"^## (.+)$", text, re.MULTILINE) == parts, file.name
        assert len(re.findall(r"\S*\w\S*", text)) < 300, file.name


def test_every_number_has_record_or_archive_line():
    folder = ROOT / "docs" / "decisions"
    kept = [int(file.name[:4]) for file in folder.glob("[0-9]*.md")]
    archive = (folder / "archive.md").read_text()
    (gone,) = re.findall(r"Records ([\d, and]+) were\b", archive)
    lines = re.findall(r"^- \*\*(\d+)\*\* ", archive, re.MULTILINE) + re.findall(r"\d+", gone)
    assert sorted([*kept, *map(int, lines)]) == list(range(1, len(kept) + len(lines) + 1))


def test_the_citation_is_of_this_version():
    from importlib.metadata import version

    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {version('lashbench')}\n" in text
    assert "Apache License" in (ROOT / "LICENSE").read_text(encoding="utf-8")


def test_physics_page_describes_every_effect():
    page = (ROOT / "docs" / "physics.md").read_text(encoding="utf-8")
    table = page[page.index("| effect |") : page.index("## Symbols")]
    assert re.findall(r"^\| ([a-z0-9-]+) \|", table, re.MULTILINE)[2:] == list(BUILT_IN)


def test_effect_on_page_equals_example_file():
    (code,) = [text for kind, text in pieces(ROOT / "docs/your-own-gimbal.md") if kind == "python"]
    file = (ROOT / "docs/examples/own-effect/tight_bearing.py").read_text(encoding="utf-8")
    assert code == file.partition("\n\n")[2]
    assert len(code.splitlines()) < 30


SAYS = {
    "headless": "complete, source confirmed-off",
    "replay": "13 points, the same to the last bit: True",
    "notebook": "183 points, 100 to 180 Hz at 1.5, 2.5, 4 V peak",
    "own_unit": "contribution ratio 0.9",
    "own_effect": "with a tight bearing",
    "fleet": "ADSS SN 7: 3 sessions, b1 0.2000 +- 0.0058 deg",
}


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs(example, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(example), *arguments_of(example, tmp_path)])
    runpy.run_path(str(example), run_name="__main__")
    assert SAYS[example.stem] in capsys.readouterr().out


def arguments_of(example, folder):
    """The quick form of the notebook; for the fleet the path of a history with estimates."""
    if example.stem == "notebook":
        return ["--quick"]
    if example.stem != "fleet":
        return []
    plan = SweepPlan((100.0, 110.0, 120.0), (2.5,))
    with Store(folder / "lab.db", create=True) as store:
        # The last one's model is refuted: its play is no wear.
        for value in (0.19, 0.2, 0.21, 0.6):
            number = store.begin(MeasurementHeader("ADSS", "SN 7", plan, "sim:", "test"))
            store.finish(number, "complete", SourceState.CONFIRMED_OFF)
            told = {
                name: {"value": value, "std": 0.01} for name in ("contribution_ratio", "b1_deg")
            }
            store.add_estimate(number, "test", told | {"refuted": value == 0.6})
    return [str(folder / "lab.db")]

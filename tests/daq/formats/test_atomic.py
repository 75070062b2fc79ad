"""Files that appear whole: nothing of others is written into, and every name is told or taken."""

import os
from pathlib import Path

import pytest
from worlds.responses import measured

from daq.errors import InputError, LashbenchError
from daq.formats import read_response, write_response
from daq.formats.atomic import keeping, replacing, write_text


def test_a_file_of_the_longest_name_is_written(tmp_path):
    """A name may have 255 bytes, and a letter up to four of them."""
    for name in ("x" * 251 + ".csv", "\N{GEAR}" * 83 + ".csv"):
        write_response(measured(), tmp_path / name)
        assert len(read_response(tmp_path / name)) == len(measured())


def test_a_name_that_is_too_long_is_told(tmp_path):
    with pytest.raises(InputError, match="File name too long"):
        write_text(tmp_path / ("x" * 300), "text")
    assert list(tmp_path.iterdir()) == []


def test_while_it_is_written_the_file_is_under_no_name_that_could_be_foreseen(tmp_path):
    names = set()
    for _ in range(3):
        with replacing(tmp_path / "x.csv") as stream:
            stream.write(b"whole")
            (found,) = {path.name for path in tmp_path.iterdir()} - {"x.csv"}
            names.add(found)
    assert len(names) == 3
    assert [path.name for path in tmp_path.iterdir()] == ["x.csv"]


def test_a_link_of_ones_own_leads_to_its_file(tmp_path):
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to(tmp_path / "real.txt")
    write_text(tmp_path / "link.txt", "new")
    assert (tmp_path / "real.txt").read_text() == "new"
    assert (tmp_path / "link.txt").is_symlink()


def test_a_link_of_another_user_is_not_followed(tmp_path):
    theirs, link = tmp_path / "colleague.txt", tmp_path / "out.txt"
    theirs.write_text("results")
    link.symlink_to(theirs)
    try:
        os.lchown(link, 12345, 12345)
    except PermissionError:
        pytest.skip("only root can make a link of another user")
    with pytest.raises(InputError, match="a link that another user made"):
        write_text(link, "ours")
    assert theirs.read_text() == "results"


def test_a_full_disk_is_told_and_leaves_nothing(small_disk):
    with pytest.raises(LashbenchError, match=r"x\.txt: could not be written \(No space left"):
        write_text(small_disk / "x.txt", "x" * 100_000)
    assert list(small_disk.iterdir()) == []


@pytest.mark.parametrize("size", [1_000, 100_000])
def test_what_can_be_made_again_is_kept_whole_or_not_at_all(small_disk, size):
    with keeping(small_disk / "folder" / "kept") as stream:
        stream.write(bytes(size))
    kept = [path for path in Path(small_disk).rglob("*") if path.is_file()]
    assert [path.stat().st_size for path in kept] == ([size] if size < 64_000 else [])


def test_where_nothing_can_be_kept_nothing_is_said(tmp_path):
    (tmp_path / "file").write_text("")
    with keeping(tmp_path / "file" / "kept") as stream:
        stream.write(b"x")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]

"""Files that appear whole: nothing of others is written into, and every name is told or taken."""

import os
from pathlib import Path

import pytest
from worlds.responses import measured

from daq.errors import InputError, LashbenchError
from daq.formats import read_response, write_response
from daq.formats.atomic import keeping, replacing, write_text


def test_longest_file_name_is_written(tmp_path):
    """A name may have 255 bytes, and a letter up to four of them."""
    for name in ("x" * 251 + ".csv", "\N{GEAR}" * 83 + ".csv"):
        write_response(measured(), tmp_path / name)
        assert len(read_response(tmp_path / name)) == len(measured())


def test_too_long_name_is_reported(tmp_path):
    with pytest.raises(InputError, match="File name too long"):
        write_text(tmp_path / ("x" * 300), "text")
    assert list(tmp_path.iterdir()) == []


def test_temporary_file_name_is_unpredictable(tmp_path):
    names = set()
    for _ in range(3):
        with replacing(tmp_path / "x.csv") as stream:
            stream.write(b"whole")
            (found,) = {path.name for path in tmp_path.iterdir()} - {"x.csv"}
            names.add(found)
    assert len(names) == 3
    assert [path.name for path in tmp_path.iterdir()] == ["x.csv"]


def test_own_link_is_followed_to_its_file(tmp_path):
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to(tmp_path / "real.txt")
    write_text(tmp_path / "link.txt", "new")
    assert (tmp_path / "real.txt").read_text() == "new"
    assert (tmp_path / "link.txt").is_symlink()


def test_link_of_another_user_is_not_followed(tmp_path):
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


def test_full_disk_is_reported_and_leaves_nothing(small_disk):
    with pytest.raises(LashbenchError, match=r"x\.txt: could not be written \(No space left"):
        write_text(small_disk / "x.txt", "x" * 100_000)
    assert list(small_disk.iterdir()) == []


@pytest.mark.parametrize("size", [1_000, 100_000])
def test_cache_file_is_kept_whole_or_omitted(small_disk, size):
    with keeping(small_disk / "folder" / "kept") as stream:
        stream.write(bytes(size))
    kept = [path for path in Path(small_disk).rglob("*") if path.is_file()]
    assert [path.stat().st_size for path in kept] == ([size] if size < 64_000 else [])


def test_unwritable_cache_raises_no_error(tmp_path):
    (tmp_path / "file").write_text("")
    with keeping(tmp_path / "file" / "kept") as stream:
        stream.write(b"x")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]

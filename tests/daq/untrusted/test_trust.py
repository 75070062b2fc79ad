"""Only what this user or root made, where nobody else may write, is believed."""

import logging
import os
from pathlib import Path

import pytest

from daq.untrusted.trust import distrust, own_folder, read_own


@pytest.mark.parametrize(("mode", "kept"), [(0o700, True), (0o755, True), (0o757, False),
                                            (0o777, False), (0o1777, False)])  # fmt: skip
def test_folder_others_may_write_is_not_used(tmp_path, mode, kept):
    folder = tmp_path / "cache"
    folder.mkdir()
    (folder / "file").write_bytes(b"content")
    folder.chmod(mode)
    assert (distrust(folder) is None) is kept
    assert read_own(folder / "file") == (b"content" if kept else None)
    assert (own_folder(folder) == folder) is kept


def test_each_parent_counts_unless_renaming_is_restricted(tmp_path):
    """Only owners may rename in a sticky folder."""
    folder = tmp_path / "shared" / "mine"
    folder.mkdir(parents=True, mode=0o700)
    folder.parent.chmod(0o777)
    assert distrust(folder) == f"{folder.parent} can be written by others"
    folder.parent.chmod(0o1777)
    assert distrust(folder) is None


def test_writable_or_linked_file_is_not_read(tmp_path):
    """Writable by others."""
    file, link = tmp_path / "file", tmp_path / "link"
    file.write_bytes(b"content")
    link.symlink_to(file)
    assert read_own(link) is None
    assert read_own(tmp_path) is None
    assert read_own(tmp_path / "nowhere") is None
    file.chmod(0o666)
    assert read_own(file) is None
    file.chmod(0o644)
    assert read_own(file) == b"content"
    (tmp_path / "other").hardlink_to(file)
    assert read_own(file) is None


@pytest.mark.skipif(os.getuid() != 0, reason="only root can give files away")
def test_file_of_another_user_is_not_used(tmp_path):
    folder = tmp_path / "cache"
    folder.mkdir()
    (folder / "file").write_bytes(b"content")
    os.chown(folder / "file", 12345, 12345)
    assert read_own(folder / "file") is None
    os.chown(folder, 12345, 12345)
    assert distrust(folder) == f"{folder} belongs to another user"


def test_foreign_group_counts_as_others(tmp_path):
    folder = tmp_path / "cache"
    folder.mkdir()
    try:
        os.chown(folder, -1, 12345)
    except PermissionError:
        pytest.skip("only root can give a folder to any group")
    folder.chmod(0o770)
    assert distrust(folder) == f"{folder} can be written by others"
    os.chown(folder, -1, os.getgid())
    assert distrust(folder) is None


def test_replacement_folder_is_private_and_reported_once(tmp_path, caplog):
    folder = tmp_path / "cache"
    folder.mkdir()
    folder.chmod(0o777)
    with caplog.at_level(logging.WARNING, "lashbench.trust"):
        places = {own_folder(folder) for _ in range(3)}
    (place,) = places
    assert distrust(place.parent) is None
    assert place.parent.stat().st_mode & 0o077 == 0
    assert not place.is_relative_to(tmp_path)
    assert [record.getMessage() for record in caplog.records] == [
        f"{folder} can be written by others; what is kept there is not used but made anew in this "
        "run; to use it, let only yourself write there (chmod go-w)"
    ]


def test_folder_is_created_for_this_user_only(tmp_path):
    before = os.umask(0o002)
    try:
        made = own_folder(tmp_path / "new")
    finally:
        os.umask(before)
    assert made == tmp_path / "new"
    assert made.stat().st_mode & 0o777 == 0o700


def test_folder_creation_error_is_left_to_writer(tmp_path):
    (tmp_path / "file").write_text("")
    assert own_folder(tmp_path / "file" / "below") == Path(tmp_path / "file" / "below")

"""Files are read whole, regular and of bounded size; what is written never goes through a link."""

import os
import stat
import threading
from pathlib import Path

import pytest

from tests.helpers import refused
from trajevo.base.files import (
    SCRATCH,
    check_writable,
    locked,
    opened_lock,
    opening_robots_only,
    own_folder,
    read_bytes,
    read_text,
    write_whole,
)


def test_only_regular_files_of_sane_size_are_read(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "large").write_bytes(b"x" * 11)
    (tmp_path / "link").symlink_to(tmp_path / "large")
    refused(lambda: read_bytes(tmp_path / "pipe"), "pipe: expected a regular file, got a pipe")
    refused(lambda: read_bytes(tmp_path), "expected a regular file, got a folder")
    refused(lambda: read_bytes(tmp_path / "large", most=10), "large: expected a file of at most .* MiB, got")
    assert read_bytes(tmp_path / "link", most=11) == b"x" * 11
    for device in ("/dev/zero", "/dev/null", "/dev/tty0"):
        if os.path.exists(device) and os.access(device, os.R_OK):
            refused(lambda device=device: read_bytes(type(tmp_path)(device)), "expected a regular file, got a device")
    with pytest.raises(FileNotFoundError):
        read_bytes(tmp_path / "none")
    refused(lambda: read_bytes(tmp_path / "a\0b"), "expected the path of a file")


def test_text_has_the_line_ends_of_this_language(tmp_path):
    (tmp_path / "text").write_bytes("a\r\nb\rc\n°".encode())
    assert read_text(tmp_path / "text") == "a\nb\nc\n°"


def test_the_data_of_a_run_opens_no_files_but_robots(tmp_path):
    robots = ("two.urdf", "TWO.URDF", "two.xml", "link.stl", "link.STL", "link.obj", "link.dae", "robot.toml")
    for name in ("points.csv", *robots):
        (tmp_path / name).write_text("content")
    with opening_robots_only("the record"):
        assert {read_bytes(tmp_path / name) for name in robots} == {b"content"}
        refused(
            lambda: read_bytes(tmp_path / "points.csv"), "the record names a file to read, '.*points.csv'; the data"
        )
    assert read_bytes(tmp_path / "points.csv") == b"content"


@pytest.mark.parametrize("name", ["front.json", f"front.json{SCRATCH}", "elsewhere"])
def test_nothing_is_written_through_a_link(name, tmp_path):
    other = tmp_path / "other"
    other.write_text("keep me")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / name).symlink_to(other)
    write_whole(tmp_path / "run" / "front.json", b"new")
    assert other.read_text() == "keep me"
    assert (tmp_path / "run" / "front.json").read_bytes() == b"new"
    assert not (tmp_path / "run" / "front.json").is_symlink()


def test_a_link_that_leads_nowhere_is_replaced_and_its_target_not_made(tmp_path):
    (tmp_path / "front.json").symlink_to(tmp_path / "nowhere")
    write_whole(tmp_path / "front.json", b"new")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["front.json"]


def test_whether_a_file_can_be_written_is_known_before_and_leaves_nothing(tmp_path):
    (tmp_path / "old").write_text("keep me")
    for name in ("new", "old"):
        check_writable(tmp_path / name)
    check_writable(Path("/dev/null"))
    assert [path.name for path in tmp_path.iterdir()] == ["old"]
    assert (tmp_path / "old").read_text() == "keep me"
    for file in (tmp_path, tmp_path / "no" / "file", tmp_path / "old" / "file", tmp_path / ("x" * 300)):
        with pytest.raises(OSError):  # noqa: PT011  (which one differs by system)
            check_writable(file)
        with pytest.raises(OSError):  # noqa: PT011
            write_whole(file, b"new")


def test_files_have_the_permissions_that_the_user_s_mask_allows(tmp_path):
    write_whole(tmp_path / "file", b"new")
    mask = os.umask(0)
    os.umask(mask)
    assert stat.S_IMODE((tmp_path / "file").stat().st_mode) == 0o666 & ~mask


def test_a_pipe_is_written_to_and_one_without_a_reader_is_not_waited_for(tmp_path, monkeypatch):
    monkeypatch.setattr("trajevo.base.files._PATIENCE", 0.2)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="No such device"):
        write_whole(tmp_path / "pipe", b"new")
    read = []
    reader = threading.Thread(target=lambda: read.append((tmp_path / "pipe").read_bytes()))
    reader.start()
    write_whole(tmp_path / "pipe", b"x" * 200_000)
    reader.join(10)
    assert read == [b"x" * 200_000]


def test_folders_and_locks_are_not_reached_through_links(tmp_path):
    (tmp_path / "other").mkdir()
    (tmp_path / "plots").symlink_to(tmp_path / "other")
    refused(lambda: own_folder(tmp_path / "plots"), "plots: expected a folder, got a link to .*other; remove the link")
    (tmp_path / ".lock").symlink_to(tmp_path / "other" / "made")
    with pytest.raises(OSError, match="symbolic links|Too many"):
        opened_lock(tmp_path / ".lock")
    assert not list((tmp_path / "other").iterdir())
    with opened_lock(tmp_path / "lock") as lock:
        assert locked(lock.fileno())

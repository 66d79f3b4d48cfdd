# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that appear whole or not at all."""

import os
import sys

import pytest

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.common.whole_file import write_whole


def test_a_file_takes_the_place_of_another(tmp_path):
    path = tmp_path / "field.safetensors"
    for data in (b"one", b"another"):
        write_whole(path, data)
        assert path.read_bytes() == data
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(sys.platform == "win32", reason="modes of POSIX")
def test_it_may_be_read_by_whom_other_files_may_be(tmp_path):
    (tmp_path / "other").write_bytes(b"")
    write_whole(tmp_path / "file", b"data")
    assert (tmp_path / "file").stat().st_mode == (tmp_path / "other").stat().st_mode


def test_a_folder_that_is_not_there_is_told(tmp_path):
    with pytest.raises(SculptError, match="Choose another folder"):
        write_whole(tmp_path / "none" / "file", b"data")


def test_a_disk_without_modes(tmp_path, monkeypatch):
    """As a USB stick's, which refuses to change them."""

    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "chmod", refuse)
    write_whole(tmp_path / "file", b"data")
    assert (tmp_path / "file").read_bytes() == b"data"


def test_an_interruption_leaves_what_was_there(tmp_path, monkeypatch):
    (tmp_path / "file").write_bytes(b"before")

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_whole(tmp_path / "file", b"data")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    assert (tmp_path / "file").read_bytes() == b"before"


def test_an_interruption_when_it_is_in_its_place(tmp_path, monkeypatch):
    replace = os.replace

    def interrupt(*given: str) -> None:
        replace(*given)
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_whole(tmp_path / "file", b"data")
    assert (tmp_path / "file").read_bytes() == b"data"

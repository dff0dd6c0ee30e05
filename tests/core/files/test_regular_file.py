"""Tests of reading text files that anybody may have written."""

import os

import pytest

from drake_tracker.core.files.regular_file import is_file, printable, read_text


def test_a_file_is_read_up_to_a_size(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes("\ufeffgrün\r\n".encode())
    assert read_text(path, 10, encoding="utf-8-sig") == "grün\r\n"
    with pytest.raises(OSError, match="more than 0 KiB"):
        read_text(path, 9)
    path.write_bytes(b"\xff")
    with pytest.raises(UnicodeDecodeError):
        read_text(path)


def test_what_is_no_regular_file_neither_blocks_nor_ends_in_a_traceback(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", tmp_path, "/dev/zero"):
        assert not is_file(path)
        with pytest.raises(OSError, match="not a regular file"):
            read_text(path)
    for path in (tmp_path / "nothing", "a" * 5000):
        assert not is_file(path)
        with pytest.raises(OSError, match=r"No such file|name too long"):
            read_text(path)
    assert not is_file("a\0b")


def test_control_characters_are_spelled_out():
    assert printable("a\x1b[2J\r\n\x9b\ud800 ü\u00a0") == "a\\x1b[2J\\r\\n\\x9b\\ud800 ü\u00a0"

"""A file is written completely or not at all, and never through a link."""

import os
import resource

import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import replacing, write_text


def test_a_file_is_replaced_as_a_whole(tmp_path):
    path = tmp_path / "summary.json"
    path.write_text("old")
    with replacing(path) as beside:
        beside.write_text("ne")
        assert path.read_text() == "old" and beside.suffix == ".json" and beside.parent == tmp_path
        beside.write_text("new")
    assert path.read_text() == "new" and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, RuntimeError])
def test_whatever_ends_the_writing_leaves_the_old_file(tmp_path, error):
    path = tmp_path / "log.npz"
    path.write_text("old")

    def write():
        with replacing(path) as beside:
            beside.write_text("half of the")
            raise error

    with pytest.raises(error):
        write()
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_one_line_and_leaves_the_old_file(tmp_path):
    path = tmp_path / "summary.json"
    path.write_text("old")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(DrakeTrackerError) as caught:
            write_text(path, "new" * 1000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert str(caught.value) == f"{path}: cannot be written: File too large"
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_a_link_is_replaced_and_not_followed(tmp_path):
    (tmp_path / "precious").write_text("precious")
    (tmp_path / "report.html").symlink_to(tmp_path / "precious")
    write_text(tmp_path / "report.html", "page")
    assert (tmp_path / "precious").read_text() == "precious"
    assert (tmp_path / "report.html").read_text() == "page" and not (tmp_path / "report.html").is_symlink()


def test_a_pipe_a_device_and_a_folder_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/null", tmp_path):
        with pytest.raises(DrakeTrackerError, match="cannot be written: it is not a regular file"):
            write_text(path, "page")
    assert [entry.name for entry in tmp_path.iterdir()] == ["pipe"]


def test_half_a_surrogate_pair_is_written_as_an_escape(tmp_path):
    """A damaged record may contain it: JSON can name it, UTF-8 cannot."""
    write_text(tmp_path / "trials.csv", "caf\u00e9 \ud800")
    assert (tmp_path / "trials.csv").read_text(encoding="utf-8") == "caf\u00e9 \\ud800"

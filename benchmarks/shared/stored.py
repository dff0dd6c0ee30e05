"""Result files. A list of lines in `RESULTS` is stored compressed: ``ball.jsonl`` as ``ball.jsonl.gz``."""

import gzip
from contextlib import contextmanager
from pathlib import Path

from drake_tracker.campaign.directory import Record, parse_lines

RESULTS = Path(__file__).parents[1] / "results"


def read_text(path):
    """Returns the text of a result file, given by its name without ``.gz``."""
    packed = compressed(path)
    if path.exists() or not packed.exists():
        return path.read_text(encoding="utf-8")
    return gzip.decompress(packed.read_bytes()).decode()


def read_lines(path):
    """Returns the rows of a JSONL file; none without a file."""
    return parse_lines(read_text(path).encode(), path) if path.exists() or compressed(path).exists() else []


def result_files():
    """Returns the paths of all result files, without ``.gz``, and without those that say how another one was made."""
    paths = {path.with_suffix("") if path.suffix == ".gz" else path for path in RESULTS.iterdir()}
    return sorted(path for path in paths if not path.name.endswith(".meta.json"))


@contextmanager
def record(path):
    """Opens a JSONL file to append to. One in `RESULTS` is not compressed until the benchmark ends.

    A benchmark that adds nothing leaves the compressed file as it is: another zlib packs the same lines differently.
    """
    packed = compressed(path)
    if packed.exists() and not path.exists():
        path.write_text(read_text(path), encoding="utf-8")
    with Record(path) as opened:
        yield opened
    if path.resolve().parent == RESULTS:
        lines = path.read_bytes()
        if not packed.exists() or gzip.decompress(packed.read_bytes()) != lines:
            packed.write_bytes(gzip.compress(lines, mtime=0))
        path.unlink()


def compressed(path):
    """Returns the path of a result file when it is compressed."""
    return path.with_name(f"{path.name}.gz")

"""Schema and bytes of numbers, read by the library of Protocol Buffers; a full disk."""

import os
import subprocess
import sys
import warnings

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass

from drake_tracker.core.files.mcap_file import encode_numbers, number_schema


@pytest.mark.parametrize("count", [0, 1, 15, 16, 300])  # from 16 on a tag has two bytes, from 128 on a length
def test_the_library_reads_what_was_written(count):
    names, values = [f"field_{k}" for k in range(count)], np.linspace(-1e9, 1e-9, count).tolist()
    files = FileDescriptorSet.FromString(number_schema("package", "Numbers", names))
    pool = DescriptorPool()
    pool.Add(files.file[0])
    descriptor = pool.FindMessageTypeByName("package.Numbers")
    assert files.file[0].syntax == "proto3" and [field.name for field in descriptor.fields] == names
    message = GetMessageClass(descriptor).FromString(encode_numbers(values))
    assert [getattr(message, name) for name in names] == values


def test_zeros_and_numbers_that_are_not_finite_are_written():
    assert len(encode_numbers([0.0, np.nan, np.inf])) == 27


FULL_DISK = """
from pathlib import Path
import numpy as np
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.mcap_file import McapFile
file = McapFile(Path("a.mcap"))
said = []
for number in range(3000):
    try:
        file.points("/p", 0.01 * number, np.random.default_rng(number).random((1000, 3)))
    except DrakeTrackerError as error:
        said.append(str(error))
try:
    file.close()
except DrakeTrackerError as error:
    said.append(str(error))
print(set(said))
"""


def test_a_full_disk_is_one_line(tmp_path):
    """On a file system of 1 MB: a limit on the size of files would end the process in another way."""
    program = 'mount -t tmpfs -o size=1m none "$PWD" && cd "$PWD" && exec "$PYTHON" -c "$FULL_DISK"'
    environment = {**os.environ, "PYTHON": sys.executable, "FULL_DISK": FULL_DISK}
    command = ["unshare", "--map-root-user", "--mount", "bash", "-c", program]
    try:
        child = subprocess.run(
            command, capture_output=True, text=True, timeout=120, env=environment, cwd=tmp_path, check=False
        )
        failed = "" if child.returncode == 0 else child.stderr
    except OSError as error:
        failed = str(error)
    if "unshare" in failed or "mount" in failed or "Permission" in failed:
        warnings.warn("a small file system cannot be made here: a full disk was not tested", stacklevel=1)
        return
    assert child.stdout == "{'a.mcap: cannot be written: No space left on device'}\n", child.stdout + child.stderr
    assert child.stderr == ""

"""Schema and bytes of numbers, read by the library of Protocol Buffers."""

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

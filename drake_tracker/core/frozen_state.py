"""Arrays that are kept in a state, which is shared between copies of a Context and must never change."""


def read_only(array):
    """Returns the array itself with its write flag cleared."""
    array.setflags(write=False)
    return array

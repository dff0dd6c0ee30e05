"""Settings with other constants than those of the package."""


def variant(kind, **constants):
    """Returns a class of settings that differs from ``kind`` in class variables."""
    for name in constants:
        assert hasattr(kind, name), name
    return type(kind.__name__, (kind,), constants)

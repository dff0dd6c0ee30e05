"""Most tests of tracks do without the picture, whose process takes longer than the track."""

import pytest


class NoPicture:
    """In place of the process that draws: checks what it gets, and leaves an empty file."""

    def draw(self, data, path, **options):
        assert len(data["stamp"]) >= 0 and options["period"] > 0.0
        path.touch()

    def close(self):
        pass


@pytest.fixture(autouse=True)
def pictures(request, monkeypatch):
    """Draws the picture of a track only in tests with the mark ``pictures``."""
    if request.node.get_closest_marker("pictures") is None:
        monkeypatch.setattr("drake_tracker.own_cameras.track.PictureProcess", NoPicture)

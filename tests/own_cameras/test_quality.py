"""The line on what may be wrong with a track."""

import pytest

from drake_tracker.own_cameras.quality import doubts


def test_nothing_wrong_gives_no_line():
    assert doubts({"images_with_rivals": 0, "leaps": 0, "states": {"moving": 10}}) is None


def test_one_image_and_several():
    assert doubts({"states": {"hidden": 1}, "leaps": 2}) == (
        "Note: the object leapt 2 times; an object was hidden in 1 row."
    )


@pytest.mark.parametrize("given", [{"follow": [[3.0, 4.0]]}, {"roi": [[[0.0, 0.0, 9.0, 9.0]]]}])
def test_options_are_not_recommended_to_those_who_gave_them(given):
    summary = {"images_with_rivals": 3}
    assert "(--follow, --roi)" in doubts(summary)
    assert "larger, in 3 images." in doubts(summary | given)


def test_points_beside_the_plane_are_named_unless_there_are_no_others():
    said = "an object was seen in 3 rows where the camera does not see the plane"
    assert said in doubts({"off_plane": 3, "results": 5})
    assert doubts({"off_plane": 3, "results": 0}) is None

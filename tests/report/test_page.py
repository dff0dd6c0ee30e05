"""The page of a run that is complete, half-written, or of another version."""

import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from track_messages import track, track_points, tracks_signal

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import Signal, save_log
from drake_tracker.core.messages import TrackState
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.report.page import page_of
from drake_tracker.report.run_files import read_run
from drake_tracker.vision.silhouettes.target import REASONS, Reason


class Links(HTMLParser):
    """Collects what a page refers to, and whether each element is closed."""

    def __init__(self):
        super().__init__()
        self.links, self.open = set(), []

    def handle_starttag(self, tag, attributes):
        self.links |= {value for name, value in attributes if name in ("src", "href")}
        if tag not in ("meta", "link", "img", "path", "rect", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in ("path", "rect"):
            assert self.open.pop() == tag


def page(folder):
    return page_of(read_run(folder))


def edit_summary(folder, **changes):
    path = folder / "summary.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def test_the_page_shows_the_whole_run_and_links_to_nothing_else(run_folder):
    text = page(run_folder)
    parser = Links()
    parser.feed(text)
    assert parser.open == []
    assert parser.links - {"data:,"} == {path.name for path in run_folder.iterdir()}
    assert "<script" not in text and "http" not in text
    for words in (
        "not lifted",
        "Attempt 1 missed",
        "The main cause was the servo",
        "Phases",
        "12.3 mm",
        "attempt 1: missed",
    ):
        assert words in text
    assert "made-up &lt;1&gt;" in text and "made-up <1>" not in text


def test_bars_are_sorted_and_the_culprit_is_marked(run_folder):
    bar = r'<th scope="row">([\w ]+)</th>\s*<td class="track">\s*<div>\s*<div class="(bar[\w ]*)"'
    rows = re.findall(bar, page(run_folder))
    assert rows[0] == ("servo", "bar worst")
    assert len({stage for stage, _ in rows[:7]}) == 7


def test_the_page_of_a_killed_run_shows_what_there_is(run_folder):
    for name in ("summary.json", "tracking.png"):
        (run_folder / name).unlink()
    log = run_folder / "log.npz"
    log.write_bytes(log.read_bytes()[:1000])
    text = page(run_folder)
    assert "There is no summary" in text and "log.npz cannot be read" in text and "no verdict" in text
    assert "Not in the directory: tracking.png." in text
    assert 'src="cameras.mp4"' in text and "tracking.png" not in re.findall(r'src="([^"]+)"', text)


def test_a_run_that_wrote_only_its_scenario(run_folder):
    for path in run_folder.iterdir():
        if path.name != "scenario.yaml":
            path.unlink()
    text = page(run_folder)
    assert "There is no summary" in text and "seed 1" in text


def test_another_version_is_noted(run_folder):
    edit_summary(run_folder, package_versions={"drake_tracker": "9.8.7"})
    assert "This run was made by version 9.8.7" in page(run_folder)


def test_an_unreadable_scenario_costs_only_the_autopsy(run_folder):
    path = run_folder / "scenario.yaml"
    path.write_text(path.read_text().replace("descent_duration", "descent_time"))
    text = page(run_folder)
    assert "scenario.yaml cannot be read" in text and "There is no autopsy" in text
    assert "Phases" in text and "12.3 mm" in text


def test_no_video_is_missing_with_measured_vision(run_folder):
    path = run_folder / "scenario.yaml"
    measured = "vision: !Measured {method: !OneObject {}, outline: ellipse}\n"
    text = re.sub(r"vision:\n(    .*\n)+", measured, path.read_text())
    assert "!Measured" in text
    path.write_text(text)
    for name in ("cameras.mp4", "motion.png"):
        (run_folder / name).unlink()
    assert "Not in the directory" not in page(run_folder)


@pytest.mark.parametrize("summary", ["[1, 2]", "{", '"text"'])
def test_an_unreadable_summary_is_noted(run_folder, summary):
    (run_folder / "summary.json").write_text(summary)
    assert "summary.json cannot be read" in page(run_folder)


def test_rejected_packets_are_counted_by_reason(run_folder):
    assert "packets rejected" not in page(run_folder)
    edit_summary(run_folder, packets_rejected=12, packets_rejected_for={"future": 9, "too_fast": 3, "made_up": 1})
    text = page(run_folder)
    for words, count in (("the stamp is later than the arm", 9), ("the path is faster than", 3)):
        assert re.search(f"packets rejected: {words}[^<]*</span><b>{count}</b>", text)
    assert text.count("packets rejected") == 2


@pytest.mark.parametrize("wrong", [3, {"future": "many"}, {"future": 1e300}, [1, 2]])
def test_wrong_counts_of_rejected_packets_are_noted_and_not_shown(run_folder, wrong):
    edit_summary(run_folder, packets_rejected_for=wrong)
    text = page(run_folder)
    assert "packets_rejected_for" in text and "packets rejected" not in text


def test_trouble_with_the_tracks_is_told(run_folder, made_up):
    save_log(
        {**made_up[1], "tracks": tracks_signal(lambda k: track_points(k / 60, [track(1)], 1), 60)},
        run_folder / "log.npz",
    )
    edit_summary(run_folder, tracking={"sentences": ["The target changed <once>."]})
    assert "<p>The target changed &lt;once&gt;.</p>" in page(run_folder)
    for wrong in (3, {"sentences": "none"}, {"sentences": [1]}):
        edit_summary(run_folder, tracking=wrong)
        assert "tracking" in page(run_folder) and "The target changed" not in page(run_folder)
    edit_summary(run_folder, tracking=None)
    assert "The target changed" not in page(run_folder)


def test_the_sentences_on_lost_parts_are_shown(run_folder):
    edit_summary(run_folder, lost_parts={"sentences": ["Part 5 (box), <dropped>."]})
    assert "<li>Part 5 (box), &lt;dropped&gt;.</li>" in page(run_folder)
    for wrong in ("none", {"sentences": [1]}, None):
        edit_summary(run_folder, lost_parts=wrong)
        assert "Parts that were not placed" not in page(run_folder)


def test_the_page_of_a_caught_ball_needs_only_its_summary(run_folder):
    for name in ("scenario.yaml", "log.npz"):
        (run_folder / name).unlink()
    edit_summary(
        run_folder,
        scenario="ball",
        success=True,
        failure_reason=None,
        roll_s=0.83,
        exit_speed_m_s=0.9,
        hand_error_m=-0.004,
    )
    text = page(run_folder)
    assert "it left the board 0.83 s after its release at 0.90 m/s" in text
    assert "it passed 4 mm from the middle of the cup" in text


def test_a_directory_that_is_not_a_run_is_refused(tmp_path):
    with pytest.raises(DrakeTrackerError, match="there is no such run directory"):
        read_run(tmp_path / "nowhere")
    with pytest.raises(DrakeTrackerError, match="is not a run directory"):
        read_run(tmp_path)


def test_everything_that_comes_from_files_is_escaped(run_folder):
    attack = "<script>alert(1)</script>"
    edit_summary(
        run_folder,
        scenario=attack,
        seed=attack,
        failure_reason=attack,
        package_versions={"drake_tracker": attack, attack: "1"},
    )
    (run_folder / "scenario.yaml").write_text(f"scenario: !{attack} {{}}\n")
    text = page(run_folder)
    assert "<script" not in text
    assert text.count("&lt;script&gt;alert(1)") >= 5


def test_the_tracks_of_several_objects_are_listed_where_the_log_has_them(run_folder, made_up):
    assert "<h2>Tracks</h2>" not in page(run_folder)

    def message(k):
        hidden = 30 <= k < 60
        first = track(1, state=TrackState.OCCLUDED if hidden else TrackState.MOVING)
        second = [track(7, state=TrackState.STANDING)] if k >= 90 else []
        return track_points(VISION_PERIOD * (k + 1), [first, *second], 1, Reason.OCCLUDED if hidden else Reason.NONE)

    save_log({**made_up[1], "tracks": tracks_signal(message, 120)}, run_folder / "log.npz")
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", page(run_folder)))
    assert "1 0.0 s 2.0 s moving 75 %, covered 25 % 100 mm 100 %" in text
    assert "7 1.5 s 2.0 s standing 100 % 100 mm States" in text, "it never was the target"
    assert f"{REASONS[Reason.OCCLUDED]} 25 % of the cycles" in text
    assert "While the arm used vision, there was no point in" in text, "the autopsy says so, too"


def test_a_signal_of_tracks_with_other_fields_or_strange_numbers_does_no_harm(run_folder, made_up):
    wild = tracks_signal(lambda k: np.full(len(track_points(0.0)), (-1.0) ** k * 1e300), 50)
    for signal in (wild, Signal(np.zeros(2), np.zeros((2, 1)), ("a",))):
        save_log({**made_up[1], "tracks": signal}, run_folder / "log.npz")
        assert "Summary" in page(run_folder)

"""The tracks of several objects on the page of a run, and why there was no point of the target."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.tasks.style import track_colour
from drake_tracker.tasks.tracks import STATE_WORDS, LoggedTrack, logged_tracks, reason_shares
from drake_tracker.vision.silhouettes.target import REASONS

MOST_LINES = 60
"""Largest number of tracks that the page lists; a damaged log may have any number of them."""


@dataclass(frozen=True)
class TrackLine:
    """One track.

    Attributes:
        number: identity of the track.
        colour: its colour in the pictures, "#rrggbb".
        first: when it was first seen, in words.
        last: when it was last seen.
        states: share of the time in each state.
        size: largest dimension.
        target: share of the time in which it was the target, "" if it never was.
    """

    number: int
    colour: str
    first: str
    last: str
    states: str
    size: str
    target: str


@dataclass(frozen=True)
class TracksSection:
    """The section of the page.

    Attributes:
        lines: a line for each track.
        more: number of further tracks.
        reasons: (why there was no point of the target, share of the cycles), the most frequent first.
    """

    lines: list[TrackLine]
    more: int
    reasons: list[tuple[str, str]]


def make_tracks_section(log: Mapping[str, Signal]) -> TracksSection | None:
    """Returns the section, or None for a log without tracks.

    Args:
        log: {name: Signal} of a run.
    """
    tracks = logged_tracks(log)
    reasons = [(REASONS[reason], share_words(share)) for reason, share in reason_shares(log).items()]
    if not tracks and not reasons:
        return None
    return TracksSection([_line(track) for track in tracks[:MOST_LINES]], max(len(tracks) - MOST_LINES, 0), reasons)


def share_words(share: float) -> str:
    """Returns a share of the cycles in words, such as "34 %"."""
    return "less than 1 %" if 0.0 < share < 0.01 else f"{100.0 * share:.0f} %"


def _line(track: LoggedTrack) -> TrackLine:
    seen = track.times[track.seen]
    shares = [(words, float(np.mean(track.states == state))) for state, words in STATE_WORDS.items()]
    return TrackLine(
        track.number,
        track_colour(track.number),
        f"{seen[0]:.1f} s" if len(seen) else "never",
        f"{seen[-1]:.1f} s" if len(seen) else "never",
        ", ".join(f"{words} {share_words(share)}" for words, share in shares if share > 0.0),
        f"{1e3 * track.size:.0f} mm",
        share_words(track.target_share) if track.target_share > 0.0 else "",
    )

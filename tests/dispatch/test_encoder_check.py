import numpy as np
import pytest

from drake_tracker.core.messages import EncoderReading, message_size
from drake_tracker.dispatch.encoder_history import LASTS, SPAN, EncoderCheck, EncoderHistory

SPEED = 0.15


def doubted(encoder, parts, duration=3.0):
    """Times of images after which the encoder was doubted: distances of encoder and parts as functions of time."""
    history, check, found = EncoderHistory(), EncoderCheck(), []
    for time in np.arange(0.0, duration, 1 / 60):
        reading = EncoderReading(np.zeros(message_size(EncoderReading)))
        reading.time, reading.distance, reading.valid = time, encoder(time), 1.0
        history = history.extended(reading)
        check = check.after(time, {number: place(time) for number, place in enumerate(parts, 1)}, history)
        if time < check.doubted_until:
            found.append(time)
    return np.array(found)


def moves(time):
    return SPEED * time


def noisy(time):
    return SPEED * time + 0.002 * np.sin(97.0 * time)


def test_an_encoder_that_agrees_is_not_doubted():
    assert len(doubted(moves, [noisy, moves])) == 0


def test_an_encoder_that_stands_still_is_doubted_at_once_and_trusted_again_when_it_agrees():
    stops = doubted(lambda t: SPEED * (min(t, 1.0) + max(t - 1.2, 0.0)), [noisy], 4.0)
    assert stops[0] == pytest.approx(1.08, abs=0.05)
    assert stops[-1] == pytest.approx(1.2 + SPAN + LASTS, abs=0.1)


def test_a_part_that_the_hand_moves_is_no_reason_for_doubt():
    assert len(doubted(moves, [moves, lambda t: SPEED * min(t, 1.0)])) == 0
    assert len(doubted(moves, [lambda t: SPEED * min(t, 1.0)])) > 0, "the only part that is seen contradicts it"


def test_without_parts_or_readings_there_is_nothing_to_compare():
    assert len(doubted(moves, [])) == 0
    check = EncoderCheck()
    for time in np.arange(0.0, 1.0, 1 / 60):
        check = check.after(time, {1: SPEED * time}, EncoderHistory())
    assert check.doubted_until == float("-inf") and check.after(0.5, {1: 9.0}, EncoderHistory()) is check

"""The running code: what is drawn is read again from photographs of a screen, and gives the latency."""

import numpy as np
import pytest
from screens import Screen

from drake_tracker.cameras.latency import screen_code
from drake_tracker.cameras.latency.code_reader import CodeReader, read_code
from drake_tracker.cameras.latency.measurement import estimate_latency
from drake_tracker.cameras.latency.screen_code import RANGE, draw_code, field_cells, read_field

LATENCY = 0.0473


@pytest.mark.parametrize("time", [0, 1, 16_777_215, 123_456])
def test_a_field_holds_its_time(time):
    assert read_field(field_cells(time)) == time


def test_a_field_in_the_middle_of_a_change_is_not_read():
    """The rows down to some height show the new time already."""
    rng = np.random.default_rng(3)
    wrong = 0
    for time in rng.integers(0, RANGE - 100, 300).tolist():
        old, new = field_cells(time), field_cells(time + 67)
        for rows in range(1, screen_code.SIDE):
            read = read_field(np.vstack([new[:rows], old[rows:]]))
            wrong += read not in (None, time, time + 67)
    assert wrong <= 12  # of 1500, one in 256 by chance


def test_the_checksum_is_that_of_its_name():
    """CRC-8 of "123456789" is 0xF4 with initial value 0 (ITU-T I.432.1 without the last step); here it is 0xFF."""
    value = 0xFF
    for byte in (0x12, 0x34, 0x56):
        value ^= byte
        for _ in range(8):
            value = (value << 1) & 0xFF ^ (0x07 if value & 0x80 else 0)
    assert screen_code.checksum(0x123456) == value


@pytest.mark.parametrize("times", [[40, 57, 73, 90], [107, 57, 73, 90], [RANGE - 20, RANGE - 3, 14, 30]])
def test_the_newest_field_is_found(times):
    canvas = np.full((400, 700), 128, np.uint8)
    canvas[30 : 30 + 17 * 20, 40 : 40 + 31 * 20] = draw_code([time % RANGE for time in times], 20)
    reading = read_code(canvas)
    newest = max(times, key=lambda time: (time + RANGE // 2) % RANGE)
    assert reading.time == newest % RANGE and set(reading.steps) <= {16, 17}


def test_times_out_of_turn_are_no_code():
    canvas = np.full((400, 700), 128, np.uint8)
    canvas[30 : 30 + 17 * 20, 40 : 40 + 31 * 20] = draw_code([40, 73, 57, 90], 20)
    assert read_code(canvas) is None
    assert read_code(np.full((240, 320), 90, np.uint8)) is None


def measure(screen, seed, rate, count=75, jitter=0.0005):
    """Returns the `Latency` of photographs, and how many were readable."""
    rng, reader = np.random.default_rng(seed), CodeReader()
    start, bounds = rng.uniform(0.0, 100.0), []
    for k in range(count):
        exposed = start + k / rate
        reading = reader.read(screen.photograph(exposed, rng))
        if reading is not None:
            age = exposed + rng.normal(0.0, jitter) + LATENCY - 1e-3 * reading.time
            bounds.append((age - screen.refresh, age))
    return estimate_latency(*np.transpose(bounds)), len(bounds)


@pytest.mark.parametrize(
    "conditions, rate",
    [
        ({}, 29.2),
        ({"scan": 0.014}, 25.3),
        ({"scan": 0.014, "rolling": 0.025, "exposure": 0.016, "blur": 1.6}, 29.2),
        ({"exposure": 0.033, "noise": 8.0}, 14.6),
        ({"refresh": 1.0 / 72.0, "turn": 0.5}, 29.2),
        ({"size": (640, 480), "blur": 3.0, "noise": 10.0, "scan": 0.01}, 59.3),
    ],
)
def test_the_latency_of_a_photographed_screen_is_within_two_milliseconds(conditions, rate):
    latency, readable = measure(Screen(**conditions), 11, rate)
    assert readable > 55
    assert abs(latency.seconds - LATENCY) < min(0.002, latency.uncertainty)
    assert latency.uncertainty < 0.002


def test_images_in_step_with_the_screen_say_how_little_they_know():
    """At half the rate of the screen, every image falls at the same instant of its refresh."""
    screen = Screen()
    latency, _ = measure(screen, 5, 30.0, count=40)
    assert 0.3 * screen.refresh < latency.uncertainty < 0.55 * screen.refresh
    assert abs(latency.seconds - LATENCY) < latency.uncertainty + 0.001


def test_false_readings_do_not_move_the_latency():
    rng = np.random.default_rng(8)
    age = LATENCY + rng.uniform(0.0, 1 / 60, 80)
    age[::4] = rng.uniform(-100.0, 100.0, 20)
    latency = estimate_latency(age - 1 / 60, age)
    assert abs(latency.seconds - LATENCY) < 0.002 and latency.images == 80

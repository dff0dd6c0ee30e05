import copy

import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import KNOT_COUNT, KNOT_FIELDS, Prediction, message_size, pack_prediction
from drake_tracker.link.config import Lossy
from drake_tracker.link.lossy_link import LinkState, LossyLink

PERIOD = 1.0 / 60.0


def packet(seq):
    return pack_prediction(seq * PERIOD, seq, np.full((KNOT_COUNT, len(KNOT_FIELDS)), float(seq)))


def fates(link, count):
    """Whether each of ``count`` packets was lost, and the delay [s] of those that were not."""
    state, lost, delays = LinkState(), [], []
    for seq in range(1, count + 1):
        state = link.post(state, packet(seq), seq * PERIOD)
        lost.append(state.last_lost)
        if not state.last_lost:
            delays.append(state.in_flight[-1][0] - seq * PERIOD)
    return np.array(lost), np.array(delays)


def run_lengths(lost):
    edges = np.flatnonzero(np.diff(np.concatenate([[0], lost.astype(int), [0]])))
    return edges[1::2] - edges[::2]


def test_a_perfect_link_delivers_every_packet_at_once():
    link, state = LossyLink(), LinkState()
    assert link.delivered(state, 1.0) is None
    for seq in range(1, 20):
        state = link.post(state, packet(seq), seq * PERIOD)
        np.testing.assert_array_equal(link.delivered(state, seq * PERIOD), packet(seq))
        assert len(state.in_flight) <= 2


def test_only_valid_and_new_packets_are_sent():
    link = LossyLink()
    state = link.post(LinkState(), np.zeros(message_size(Prediction)), 0.1)
    assert state == LinkState()
    state = link.post(state, packet(3), 0.2)
    assert link.post(state, packet(3), 0.3) is state


def changed(number, **fields):
    """Packet ``number`` with other values in some fields."""
    vector = packet(number)
    for name, value in fields.items():
        vector[Prediction.get_fields().index(name)] = value
    return vector


STRANGE = [{"seq": np.nan}, {"seq": np.inf}, {"seq": 1e308}, {"seq": -1}, {"spacing": 0.0}, {"x3": np.nan}]
WITHOUT_ORDER = [{"stamp": stamp} for stamp in (np.nan, np.inf, -np.inf, 1e18, 3.001, 1.49)]


@pytest.mark.parametrize("fields", [*STRANGE, *WITHOUT_ORDER, {"valid": np.nan}, {"valid": 7.0}])
@pytest.mark.parametrize("settings", [Lossy(), Lossy(drop=1e-9, jitter=1e-9)])
def test_the_link_carries_any_packet_to_its_receiver(settings, fields):
    link, strange = LossyLink(settings), changed(179, **fields)
    state = link.post(link.post(LinkState(), packet(178), 2.98), strange, 3.0)
    np.testing.assert_array_equal(link.delivered(state, 3.01), strange)
    assert link.post(state, strange, 3.02) is state


@pytest.mark.parametrize("fields", [{"stamp": stamp} for stamp in (np.nan, np.inf, -np.inf, 1e18, 5.0, 1.4)])
def test_a_packet_whose_stamp_has_no_order_hides_no_other(fields):
    link, state = LossyLink(), LinkState()
    for seq in range(180, 240):
        state = link.post(state, changed(seq, **fields), seq * PERIOD)
        state = link.post(state, packet(seq - 15), seq * PERIOD + 0.001)
        np.testing.assert_array_equal(link.delivered(state, seq * PERIOD + 0.001), packet(seq - 15))
        assert len(state.in_flight) <= 3


def test_packets_of_a_restarted_host_which_counts_from_1_are_delivered():
    link, state = LossyLink(Lossy(delay=0.1)), LinkState()
    for seq in (500, 501):
        state = link.post(state, packet(seq), seq * PERIOD)
    again = pack_prediction(510 * PERIOD, 1, np.ones((KNOT_COUNT, len(KNOT_FIELDS))))
    state = link.post(state, again, 510 * PERIOD)
    np.testing.assert_array_equal(link.delivered(state, 520 * PERIOD), again)


@pytest.mark.parametrize("drop", [0.0, 0.1, 0.5, 1.0])
def test_independent_losses_have_the_requested_rate(drop):
    lost, _ = fates(LossyLink(Lossy(drop=drop), seed=5), 6000)
    assert lost.mean() == pytest.approx(drop, abs=4 * np.sqrt(drop * (1 - drop) / 6000))
    if 0.0 < drop < 1.0:
        assert np.corrcoef(lost[1:], lost[:-1])[0, 1] == pytest.approx(0.0, abs=0.05)
        assert run_lengths(lost).mean() == pytest.approx(1 / (1 - drop), rel=0.1)


@pytest.mark.parametrize("drop, burst", [(0.2, 4.0), (0.5, 12.0), (0.1, 12.0)])
def test_bursts_have_the_requested_length_and_rate(drop, burst):
    lost, _ = fates(LossyLink(Lossy(drop=drop, burst=burst), seed=1), 15000)
    lengths = run_lengths(lost)
    # The length of a burst is geometrically distributed: its standard deviation is close to its mean.
    assert lengths.mean() == pytest.approx(burst, abs=4 * burst / np.sqrt(len(lengths)))
    assert lengths.std() == pytest.approx(np.sqrt(burst * (burst - 1)), rel=0.25)
    assert lost.mean() == pytest.approx(drop, abs=0.05)


def test_a_burst_shorter_than_by_chance_gives_independent_losses():
    lost, _ = fates(LossyLink(Lossy(drop=0.8, burst=2.0)), 300)
    independent, _ = fates(LossyLink(Lossy(drop=0.8)), 300)
    np.testing.assert_array_equal(lost, independent)


def test_the_delay_is_constant_plus_uniform_jitter():
    _, delays = fates(LossyLink(Lossy(delay=0.05, jitter=0.1), seed=2), 6000)
    assert delays.min() >= 0.05 and delays.max() <= 0.15
    np.testing.assert_allclose(np.histogram(delays, bins=10, range=(0.05, 0.15))[0] / 6000, 0.1, atol=0.015)
    _, constant = fates(LossyLink(Lossy(delay=0.05)), 50)
    np.testing.assert_allclose(constant, 0.05, atol=1e-12)


def test_an_overtaken_packet_never_replaces_a_newer_one():
    link, state = LossyLink(Lossy(jitter=0.1), seed=3), LinkState()
    arrivals = {}
    seen = []
    for step in range(1, 4 * 400):
        now = step * PERIOD / 4
        if step % 4 == 0:
            state = link.post(state, packet(step // 4), now)
            arrivals[step // 4] = state.in_flight[-1][0]
        newest = link.delivered(state, now)
        arrived = [seq for seq, arrival in arrivals.items() if arrival <= now]
        assert (None if newest is None else Prediction(newest).seq) == max(arrived, default=None)
        if newest is not None:
            seen.append(Prediction(newest).seq)
    times = np.array(list(arrivals.values()))
    overtaken = np.sum(np.minimum.accumulate(times[::-1])[::-1] < times)
    assert overtaken > 100 and np.all(np.diff(seen) >= 0)


def test_the_state_stays_small_and_is_immutable():
    link, state = LossyLink(Lossy(drop=0.3, delay=0.2, jitter=0.3), seed=4), LinkState()
    for seq in range(1, 1000):
        state = link.post(state, packet(seq), seq * PERIOD)
        assert len(state.in_flight) <= 0.5 / PERIOD + 2
    assert copy.deepcopy(state) is state
    with pytest.raises(ValueError, match="read-only"):
        state.in_flight[0][1][0] = 1.0


def test_the_link_keeps_its_own_copy_of_a_packet():
    sent = packet(1)
    link = LossyLink()
    state = link.post(LinkState(), sent, PERIOD)
    sent[:] = 7.0
    np.testing.assert_array_equal(link.delivered(state, PERIOD), packet(1))


def test_seed_and_sequence_number_decide_whether_a_packet_is_lost():
    faults = {"drop": 0.4, "jitter": 0.1, "burst": 3.0}
    once, again, other = (fates(LossyLink(Lossy(**faults), seed=seed), 200) for seed in (8, 8, 9))
    np.testing.assert_array_equal(once[0], again[0])
    np.testing.assert_array_equal(once[1], again[1])
    assert not np.array_equal(once[0], other[0])
    # Replayed from the middle, the link repeats what it did.
    link, states = LossyLink(Lossy(**faults), seed=8), [LinkState()]
    for seq in range(1, 100):
        states.append(link.post(states[-1], packet(seq), seq * PERIOD))
    state = states[50]
    for seq in range(51, 100):
        state = link.post(state, packet(seq), seq * PERIOD)
    assert [arrival for arrival, _ in state.in_flight] == [arrival for arrival, _ in states[-1].in_flight]


@pytest.mark.parametrize(
    "faults",
    [{"drop": 1.1}, {"drop": float("nan")}, {"delay": -0.1}, {"jitter": float("inf")}, {"burst": 0.5}, {"seed": -1}],
)
def test_faults_out_of_range_are_refused_by_name(faults):
    with pytest.raises(DrakeTrackerError, match=f"link {next(iter(faults))} is .*; allowed: "):
        LossyLink(Lossy(**{name: value for name, value in faults.items() if name != "seed"}), faults.get("seed", 0))

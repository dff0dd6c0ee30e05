"""The arithmetic of the faults: what each does at its place, within its time and outside of it."""

from dataclasses import replace

import numpy as np
import pytest
from faulty_runs import CAMERAS, X_WCS, free_body, make

from drake_tracker.arm.description import PUMA560
from drake_tracker.cameras.triangulation import triangulate
from drake_tracker.core.messages import KNOT_COUNT, pack_prediction
from drake_tracker.faults import config
from drake_tracker.faults.fault import FaultyView, Sight
from drake_tracker.link.lossy_link import LossyLink

WINDOW = (40, 60, 200, 150)
TRAIN = np.array([0.60, 0.15, 0.485])


def view(camera="left"):
    return FaultyView(camera, CAMERAS[camera], WINDOW)


def picture(level=120):
    image = np.full((WINDOW[3], WINDOW[2], 4), level, dtype=np.uint8)
    image[..., 3] = 255
    return image


def sight(camera="left", p_WQ=TRAIN, time=5.0):
    uv = None if p_WQ is None else CAMERAS[camera].project(p_WQ)[0]
    return Sight(camera, CAMERAS[camera], time, round(60 * time), p_WQ, uv)


def seen(fault, p_WQ=TRAIN, time=5.0):
    """Returns the point that both cameras see with a fault."""
    pixels = [fault.centroid(sight(side, p_WQ, time)) for side in CAMERAS]
    return None if any(uv is None for uv in pixels) else triangulate(*CAMERAS.values(), *pixels).p_WQ


class TestImages:
    def test_dark(self):
        fault = make(config.CameraDark(camera="left"))
        assert fault.hits("left") and not fault.hits("right")
        dark = fault.image(picture(), view(), 5.0, None)
        assert not dark[..., :3].any() and (dark[..., 3] == 255).all()
        assert fault.centroid(sight()) is None

    def test_frozen(self):
        fault = make(config.FrozenImage())
        assert (fault.image(picture(120), view(), 5.0, picture(7)) == picture(7)).all()
        assert (fault.image(picture(120), view(), 5.0, None) == picture(120)).all()
        assert fault.centroid(sight()) is None

    def test_flicker_is_a_gain_and_blinds_only_when_it_is_strong(self):
        fault = make(config.Flicker(at=0.0, amplitude=0.5, frequency=1.0))
        bright = fault.image(picture(100), view(), 0.25, None)
        assert (bright[..., :3] == 150).all() and (bright[..., 3] == 255).all()
        assert seen(make(config.Flicker(amplitude=0.05))) == pytest.approx(TRAIN)
        blind = [
            make(config.Flicker(amplitude=0.6, frequency=97.0)).centroid(sight(time=k / 60)) is None
            for k in range(60, 180)
        ]
        assert 0.2 < np.mean(blind) < 0.9

    def test_noise_is_repeatable_and_new_in_every_frame(self):
        fault = make(config.ImageNoise(std=20.0))
        noisy = fault.image(picture(), view(), 5.0, None)
        assert (noisy == fault.image(picture(), view(), 5.0, None)).all()
        assert (noisy != fault.image(picture(), view(), 5.0 + 1 / 60, None)).any()
        assert (noisy != fault.image(picture(), view("right"), 5.0, None)).any()
        assert np.std(noisy[..., 0].astype(float)) == pytest.approx(20.0, rel=0.05)
        assert (noisy[..., 3] == 255).all()
        errors = [np.linalg.norm(seen(fault, time=k / 60) - TRAIN) for k in range(60, 120)]
        assert 1e-4 < np.mean(errors) < 5e-3
        seen_share = [
            np.mean([make(config.ImageNoise(std=std)).centroid(sight(time=k / 60)) is not None for k in range(400)])
            for std in (40.0, 50.0, 60.0)
        ]
        assert seen_share == pytest.approx([1.0, 0.5, 0.0], abs=0.1)

    def test_a_knocked_camera_shows_what_a_turned_camera_sees(self):
        fault = make(config.CameraKnocked(camera="left", angle_deg=1.5, direction_deg=30.0))
        model = CAMERAS["left"]
        before = model.project(TRAIN)[0]
        after = fault.centroid(sight())
        # It looks to the right and down, so that the train moves to the left and up.
        moved = after - before
        assert np.degrees(np.arctan2(moved[1], moved[0])) == pytest.approx(30.0 - 180.0, abs=3.0)
        assert np.linalg.norm(moved) == pytest.approx(model.K[0, 0] * np.deg2rad(1.5), rel=0.02)
        image = picture(0)
        u, v = np.rint(before).astype(int) - WINDOW[:2]
        image[v - 2 : v + 3, u - 2 : u + 3, :3] = 255
        rows, columns = np.nonzero(fault.image(image, view(), 5.0, None)[..., 0] > 128)
        assert [columns.mean(), rows.mean()] == pytest.approx(after - WINDOW[:2], abs=0.7)

    def test_a_shaking_camera_has_its_standard_deviation_and_its_correlation(self):
        def displacements(correlation_time, camera="left"):
            fault = make(config.CameraShake(std=1.5, correlation_time=correlation_time))
            before = CAMERAS[camera].project(TRAIN)[0]
            return np.array([fault.centroid(sight(camera, time=k / 60)) - before for k in range(600)])

        white, slow = displacements(0.0), displacements(0.1)
        for shifts in (white, slow):
            assert shifts.std(axis=0) == pytest.approx([1.5, 1.5], rel=0.15)
        correlation = [np.mean(shifts[1:] * shifts[:-1]) / np.mean(shifts**2) for shifts in (white, slow)]
        assert abs(correlation[0]) < 0.1 and correlation[1] > 0.8
        assert np.array_equal(white, displacements(0.0))
        assert np.abs(white - displacements(0.0, "right")).mean() > 0.5

    def test_a_panned_camera_turns_at_its_rate_and_stays_where_it_looks(self):
        fault = make(config.CameraPan(at=2.0, duration=1.0, rate=0.5, direction_deg=90.0))
        assert [fault.active(time) for time in (1.99, 2.0, 2.5, 9.0)] == [False, True, True, True]
        before = CAMERAS["left"].project(TRAIN)[0]
        shifts = [fault.centroid(sight(time=time)) - before for time in (2.0, 2.5, 3.0, 9.0)]
        assert shifts[0] == pytest.approx([0.0, 0.0], abs=1e-9)
        assert [shift[1] for shift in shifts[1:]] == pytest.approx([-15.0, -30.0, -30.0], rel=0.03)
        still = fault.image(picture(), view(), 9.0, None)
        assert (still == picture()).all()

    def test_a_shadow_crosses_the_table(self):
        fault = make(config.CastShadow(at=2.0, darkness=0.5, width=0.1, speed=0.25))
        along = np.array([-0.25, 0.0, 0.25])
        assert fault.light(along, 3.0) == pytest.approx([0.5, 1.0, 1.0])
        image = fault.image(picture(200), view(), 4.0, None)
        assert image[..., 0].min() == pytest.approx(100, abs=3) and image[..., 0].max() == 200
        u, v = np.rint(CAMERAS["left"].project([0.56, 0.0, 0.45])[0]).astype(int) - WINDOW[:2]
        assert image[v, u, 0] == pytest.approx(100, abs=5)

    def test_a_shadow_in_the_work_volume_draws_the_centroid_to_itself(self):
        fault = make(config.CastShadow(at=0.0, darkness=0.6))
        far, near = fault.centroid(sight(time=0.1)), fault.centroid(sight(time=2.0))
        before = CAMERAS["left"].project(TRAIN)[0]
        assert far == pytest.approx(before) and np.linalg.norm(near - before) > 10.0
        middle = CAMERAS["left"].project([0.56, 0.0, 0.45])[0]
        assert np.linalg.norm(near - middle) < np.linalg.norm(before - middle)
        assert make(config.CastShadow(darkness=0.1)).centroid(sight(time=2.0)) == pytest.approx(before)

    def test_a_shadow_that_touches_the_train_is_seen_together_with_it(self):
        fault, joined = make(config.CastShadow(at=0.0, darkness=0.6)), 0
        for time in np.arange(0.0, 4.0, 0.05):
            seen = sight(time=time)
            both, shadow = fault.centroid(seen), fault.centroid(replace(seen, uv=None))
            if shadow is None or np.allclose(both, seen.uv) or np.allclose(both, shadow):
                continue
            joined += 1
            parts = np.linalg.norm(both - seen.uv) + np.linalg.norm(both - shadow)
            assert parts == pytest.approx(np.linalg.norm(shadow - seen.uv)), "between the train and the shadow"
        assert joined > 5


class TestScene:
    def test_an_occluder_blocks_one_line_of_sight_while_it_stands_there(self):
        fault = make(config.PassingOccluder(camera="left", at=4.0, duration=3.0))
        assert [fault.centroid(sight("left", time=time)) is None for time in (4.0, 5.0, 6.2, 6.99)] == [
            *(False, True, True, False)
        ]
        assert not fault.hits("right")
        right = X_WCS["right"][:3, 3]
        assert not any(fault.blocks(time, right, TRAIN) for time in np.arange(3.0, 8.0, 0.05))

    def test_a_narrow_occluder_does_not_block_the_rest(self):
        fault = make(config.PassingOccluder(camera="left", at=0.0, width=0.04, height=0.04))
        camera = X_WCS["left"][:3, 3]
        assert fault.blocks(5.0, camera, np.array([0.56, 0.0, 0.47]))
        assert not fault.blocks(5.0, camera, np.array([0.56, 0.2, 0.47]))

    @pytest.mark.parametrize("settings", [config.PassingOccluder(at=2.0, duration=4.0), config.SecondMover(at=2.0)])
    def test_the_speed_of_a_slide_is_the_rate_of_its_position(self, settings):
        fault = make(settings)
        for time in np.arange(1.05, 7.0, 0.1):
            rate = (fault.slide(time + 1e-5)[0] - fault.slide(time - 1e-5)[0]) / 2e-5
            assert fault.slide(time)[1] == pytest.approx(rate, abs=1e-6)

    def test_a_second_mover_draws_the_centroid_half_way_when_it_is_close(self):
        fault = make(config.SecondMover(at=0.0, place=(0.56, 0.06)))
        mover = np.array([0.56, 0.06 + fault.slide(10.0)[0], 0.475])
        point = seen(fault, time=10.0)
        assert np.linalg.norm(point - 0.5 * (mover + TRAIN)) < 0.02
        far = make(config.SecondMover(at=0.0, place=(0.7, -0.15)))
        assert far.centroid(sight("left", time=10.0)) == pytest.approx(CAMERAS["left"].project(TRAIN)[0])
        assert np.linalg.norm(seen(fault, None, 10.0) - mover) < 1e-6


class TestCalibration:
    def test_angle_and_distance(self):
        fault = make(config.CalibrationWrong(camera="right", angle_deg=1.0, distance=0.02))
        assert fault.calibrated("left", CAMERAS["left"]) is CAMERAS["left"]
        right, wrong = CAMERAS["right"].X_WC, fault.calibrated("right", CAMERAS["right"]).X_WC
        assert np.degrees(np.arccos((np.trace(right[:3, :3].T @ wrong[:3, :3]) - 1) / 2)) == pytest.approx(1.0)
        assert np.linalg.norm(right[:3, 3] - wrong[:3, 3]) == pytest.approx(0.02)


def packet(stamp, seq):
    return pack_prediction(stamp, seq, np.zeros((KNOT_COUNT, 5)))


class TestLink:
    def arrivals(self, settings):
        """Returns how many packets each second brings, for 60 packets a second."""
        link = make(settings).link(LossyLink())
        state, found = link.initial_state(), []
        for k in range(60 * 8):
            now = k / 60
            state = link.post(state, packet(now, k), now)
            delivered = link.delivered(state, now)
            found.append(-1.0 if delivered is None else delivered[0])
        return [len(set(found[60 * s : 60 * s + 60])) for s in range(8)]

    def test_packets_are_lost_only_while_the_fault_lasts(self):
        assert self.arrivals(config.LinkLoss(at=2.0, duration=2.0)) == [60, 60, 1, 1, 60, 60, 60, 60]

    def test_bursts(self):
        counts = self.arrivals(config.LinkBursts(at=2.0, duration=4.0, drop=0.5, burst=10))
        assert counts[:2] == [60, 60] and counts[7] == 60
        assert 40 < sum(counts[2:6]) < 200

    def test_jitter(self):
        counts = self.arrivals(config.LinkJitter(at=2.0, duration=4.0, jitter=0.5))
        assert all(count < 50 for count in counts[3:6])

    def test_a_delay_may_be_longer_than_a_path(self):
        counts = self.arrivals(config.LinkDelay(at=2.0, duration=1.0, delay=5.0))
        assert counts[2] == 1 and counts[3:] == [60] * 5


class Counting:
    """An estimator whose state counts its points."""

    class State:
        def __init__(self, count, stamp):
            self.count, self.stamp = count, stamp

    def initial_state(self):
        return self.State(0, -np.inf)

    def update(self, state, stamp, p_WQ):
        return state if p_WQ is None else self.State(state.count + 1, stamp)

    def ready(self, state):
        return state.count > 0


def test_a_stopped_host_sends_nothing_and_starts_with_an_empty_memory():
    estimator = make(config.HostStopped(at=2.0, duration=1.0)).estimator(Counting())
    state, counts, ready = estimator.initial_state(), {}, {}
    for k in range(60 * 4):
        stamp = k / 60  # the point arrives 0.25 s later
        state = estimator.update(state, stamp, TRAIN)
        counts[k], ready[k] = state.inner.count, estimator.ready(state)
    assert counts[104] == 105 and ready[104]
    assert not any(ready[k] for k in range(105, 165))
    assert counts[165] == 1 and ready[165]
    assert state.stamp == pytest.approx(239 / 60)
    assert estimator.update(state, 3.99, None) is state


class TestTrain:
    def test_the_drive(self):
        assert make(config.TrainStopped()).target_speed(0.2) == 0.0
        assert make(config.TrainReversed()).target_speed(0.2) == -0.2

    def test_a_push_follows_the_heading(self):
        state = free_body(yaw=np.pi / 2)
        _, along = make(config.TrainPushed(force=2.0)).wrench(5.0, state)
        _, across = make(config.TrainPushed(force=-2.0, direction="across")).wrench(5.0, state)
        assert along == pytest.approx([0.0, 2.0, 0.0]) and across == pytest.approx([2.0, 0.0, 0.0])

    def test_a_derailing_push_moves_the_train_aside_and_stops_it(self):
        fault = make(config.TrainDerailed(force=12.0, speed=0.25, side="right"))
        assert fault.wrench(0.7, free_body(velocity=(0.1, -0.25, 0.0)))[1] == pytest.approx([-2.5, 6.25, 0.0])
        assert np.linalg.norm(fault.wrench(0.7, free_body(velocity=(3.0, 0.0, 0.0)))[1]) == pytest.approx(12.0)
        assert fault.wrench(0.0, free_body())[1] == pytest.approx([0.0, -12.0, 0.0])
        assert fault.wrench(0.0, free_body(velocity=(0.1, -0.25, 0.0)))[1] == pytest.approx([0.0, 0.0, 0.0])

    def test_the_force_of_the_hand_is_bounded(self):
        fault = make(config.TrainRemoved(at=1.0, duration=3.0))
        for time in np.arange(1.0, 4.0, 0.1):
            for velocity in ((0.0, 0.0, 0.0), (3.0, -3.0, 1.0)):
                torque, force = fault.wrench(time, free_body(velocity=velocity))
                assert np.linalg.norm(force - [0.0, 0.0, 0.25 * 9.81]) <= 8.0 + 1e-9
                assert torque == pytest.approx(np.zeros(3))


class TestArm:
    def test_friction_opposes_the_motion_of_one_joint_and_is_bounded(self):
        fault = make(config.StickingJoint(joint=2, friction=10.0))
        assert fault.torques(np.array([1.0, -5.0, 1.0, 0.0, 0.0, 0.0])) == pytest.approx(
            [0.0, 10.0, 0.0, 0.0, 0.0, 0.0]
        )
        assert fault.torques(np.zeros(6)) == pytest.approx(np.zeros(6))

    def test_friction_never_turns_the_motion_round_in_one_step(self):
        for joint, inertia in enumerate(PUMA560.servo_inertia):
            fault = make(config.StickingJoint(joint=joint + 1, friction=50.0))
            for v in (1e-4, 0.01, 0.3, 5.0):
                velocity = np.zeros(6)
                velocity[joint] = v
                assert v + fault.torques(velocity)[joint] / inertia / 300 >= 0.4 * v

    def test_a_slow_gripper_moves_its_set_point_slowly(self):
        fault = make(config.SlowGripper(speed=0.06))
        assert fault.set_point(np.array([0.02, -0.2]), 0.04, 0.04, 0.01) == pytest.approx([0.0397, -0.03])
        assert fault.set_point(np.array([0.02, 0.0]), 0.0201, 0.0201, 0.01) == pytest.approx([0.02, 0.0])

    def test_a_weak_gripper_is_a_spring_with_a_limit(self):
        fault = make(config.WeakGripper(force=1.0))
        set_point = fault.set_point(np.array([0.01, -0.2]), 0.04, 0.02, 0.01)
        assert 5000.0 * (0.02 - set_point[0]) == pytest.approx(2.0) and set_point[1] == 0.0

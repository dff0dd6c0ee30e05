"""The MCAP file of a run, read back by the readers of the format."""

import sys

import cv2
import numpy as np
import pytest
from mcap_messages import numbers_of, points_of, read_mcap
from scipy.spatial.transform import Rotation

from drake_tracker import load_scenario
from drake_tracker.arm.arm_model import make_arm_model
from drake_tracker.arm.description import PUMA560
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.mcap_file import McapFile
from drake_tracker.core.log import load_log
from drake_tracker.run.mcap_recording import MCAP_FILE
from drake_tracker.run.options import RunOptions
from drake_tracker.run.simulation import simulate


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    scenario = load_scenario("train:learned", seed=4, duration=0.8)
    simulate(scenario, folder, RunOptions(record=False, mcap=True))
    return read_mcap(folder / MCAP_FILE), load_log(folder)


def test_images_have_the_time_of_their_capture_and_the_size_of_the_calibration(run):
    topics, _ = run
    times = [time for time, _ in topics["/camera_left/image"]]
    np.testing.assert_allclose(times, np.arange(len(times)) / 30, atol=1e-9)
    assert len(times) >= 15
    _, image = topics["/camera_left/image"][-1]
    (_, calibration), *_ = topics["/camera_left/calibration"]
    height, width = cv2.imdecode(np.frombuffer(image.data, np.uint8), cv2.IMREAD_COLOR).shape[:2]
    assert (width, height) == (calibration.width, calibration.height)
    assert image.frame_id == calibration.frame_id == "camera_left"


def test_the_frames_of_the_arm_are_those_of_its_joints(run):
    topics, log = run
    model = make_arm_model(PUMA560)
    time, joints = topics["/joint_states"][-1]
    k = np.flatnonzero(np.isclose(log["arm_state"].times, time))[0]
    q = log["arm_state"].data[k, : model.num_joints]
    assert [joint.name for joint in joints.joints] == list(model.joint_names)
    np.testing.assert_allclose([joint.position for joint in joints.joints], q)
    transforms = next(each for t, each in topics["/tf"] if t == time and len(each.transforms) > 1).transforms
    poses = model.body_poses(q)
    assert {transform.child_frame_id for transform in transforms} == set(poses)
    for transform in transforms:
        X_WB, p, turn = poses[transform.child_frame_id], transform.translation, transform.rotation
        np.testing.assert_allclose([p.x, p.y, p.z], X_WB[:3, 3], atol=1e-12)
        R = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
        np.testing.assert_allclose(R, X_WB[:3, :3], atol=1e-12)


def test_points_truth_and_numbers_are_those_of_the_log(run):
    topics, log = run
    valid = log["point"].data[log["point"]["valid"] > 0]
    distinct = np.unique(valid[:, 0])
    assert len(topics["/point"]) == len(distinct) > 10
    np.testing.assert_array_equal(points_of(topics["/point"][-1][1]), valid[-1:, 1:4])
    pose = topics["/truth_train_state"][-1][1].pose
    truth = log["truth_train_state"]
    np.testing.assert_allclose([pose.position.x, pose.orientation.w], truth.data[-1][[4, 0]])
    assert numbers_of(topics["/signals/point"][-1][1]) == dict(zip(log["point"].names, log["point"].data[-1].tolist()))
    poses = topics["/prediction"][-1][1].poses
    assert len(poses) == 31
    path = [[pose.position.x, pose.position.y, pose.position.z] for pose in poses]
    np.testing.assert_array_equal(points_of(topics["/prediction/points"][-1][1]), path)
    assert topics["/phase"][0][1].message == "ACQUIRE"


def test_every_topic_has_a_schema_that_can_be_shown(run):
    """Foxglove's schemas that panels draw or plot, or numbers. None draws ``Point3InFrame``; Rerun reads no JSON."""
    drawn = {
        "CameraCalibration", "CompressedImage", "FrameTransforms", "ImageAnnotations", "JointStates", "Log",
        "PointCloud", "PoseInFrame", "PosesInFrame",
    }  # fmt: skip
    topics, _ = run
    for topic, messages in topics.items():
        package, _, name = messages[0][1].DESCRIPTOR.full_name.partition(".")
        assert (package == "foxglove" and name in drawn) or (
            package == "drake_tracker" and name == topic.strip("/").replace("/", "_")
        )


def test_numbers_of_any_size_and_kind_are_kept(tmp_path):
    values = {f"field_{k}": 1.5 * k for k in range(40)} | {"negative": -1e300, "infinite": np.inf, "none": np.nan}
    file = McapFile(tmp_path / "a.mcap")
    file.values("/signals/camera_left/centroid", 0.5, values)
    file.close()
    ((time, message),) = read_mcap(tmp_path / "a.mcap")["/signals/camera_left/centroid"]
    assert time == 0.5 and message.DESCRIPTOR.full_name == "drake_tracker.signals_camera_left_centroid"
    np.testing.assert_equal(numbers_of(message), values)


def test_the_missing_extra_is_one_line(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(DrakeTrackerError, match=r"run.mcap: foxglove .* pip install 'drake-tracker\[mcap\]'"):
        McapFile(tmp_path / "run.mcap")
    assert not (tmp_path / "run.mcap").exists()

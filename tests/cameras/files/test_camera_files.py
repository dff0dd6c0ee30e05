"""Calibration files of other tools: as those tools write them, there and back, and broken."""

import cv2
import numpy as np
import pytest
from board_pictures import pose

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.camera_files import FORMATS, load_cameras, save_foreign
from drake_tracker.core.errors import DrakeTrackerError

K = np.array([[533.51, 0.0, 341.72], [0.0, 534.02, 233.91], [0.0, 0.0, 1.0]])
LENSES = {
    "pinhole": ("pinhole", [-0.281, 0.0725, 0.00121, -0.00087, 0.0]),
    "rational": ("pinhole", [0.5, 0.11, 0.0007, -0.0004, 0.02, 0.85, 0.2, 0.05]),
    "fisheye": ("fisheye", [-0.013, 0.021, -0.02, 0.004]),
}
X_RL = pose([0.012, 0.031, -0.007], [-0.0831, 0.00112, 0.00048])
POINTS = np.random.default_rng(0).uniform([-0.3, -0.2, 0.6], [0.3, 0.2, 1.2], (60, 3))

# As the sample stereo_calib.cpp of OpenCV writes them.
INTRINSICS = """%YAML:1.0
---
M1: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3351e+02, 0., 3.4172e+02, 0., 5.3402e+02, 2.3391e+02, 0.,
       0., 1. ]
D1: !!opencv-matrix
   rows: 1
   cols: 14
   dt: d
   data: [ -2.81e-01, 7.25e-02, 1.21e-03, -8.7e-04, 0., 0., 0., 0., 0., 0.,
       0., 0., 0., 0. ]
M2: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3351e+02, 0., 3.4172e+02, 0., 5.3402e+02, 2.3391e+02, 0.,
       0., 1. ]
D2: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -2.81e-01, 7.25e-02, 1.21e-03, -8.7e-04, 0. ]
"""
EXTRINSICS = f"""%YAML:1.0
---
R: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: {X_RL[:3, :3].ravel().tolist()}
T: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: {X_RL[:3, 3].tolist()}
Q: !!opencv-matrix
   rows: 4
   cols: 4
   dt: d
   data: [ 1., 0., 0., -3.1e+02, 0., 1., 0., -2.5e+02, 0., 0., 0., 5.3e+02,
       0., 0., 1.2e+01, 0. ]
"""
# As the tutorial camera_calibration.cpp writes it, as XML.
SINGLE_XML = """<?xml version="1.0"?>
<opencv_storage>
<calibration_time>"Mon 02 Mar 2020 10:11:12"</calibration_time>
<image_width>640</image_width>
<image_height>480</image_height>
<board_width>9</board_width>
<!-- flags:  +fix_k4 -->
<fisheye_model>0</fisheye_model>
<camera_matrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    5.3351e+02 0. 3.4172e+02 0. 5.3402e+02 2.3391e+02 0. 0. 1.</data></camera_matrix>
<distortion_coefficients type_id="opencv-matrix">
  <rows>5</rows>
  <cols>1</cols>
  <dt>d</dt>
  <data>
    -2.81e-01 7.25e-02 1.21e-03 -8.7e-04 0.</data></distortion_coefficients>
</opencv_storage>
"""


def ros(
    name, R="1.000000, 0.000000, 0.000000, 0.000000, 1.000000, 0.000000, 0.000000, 0.000000, 1.000000", Tx="0.00000"
):
    """As the node cameracalibrator of ROS writes it, with five and six decimals."""
    return f"""image_width: 640
image_height: 480
camera_name: {name}
camera_matrix:
  rows: 3
  cols: 3
  data: [533.51000,   0.     , 341.72000,
           0.     , 534.02000, 233.91000,
           0.     ,   0.     ,   1.     ]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.281000, 0.072500, 0.001210, -0.000870, 0.000000]
rectification_matrix:
  rows: 3
  cols: 3
  data: [{R}]
projection_matrix:
  rows: 3
  cols: 4
  data: [500.00000,   0.     , 330.00000,   {Tx},
           0.     , 500.00000, 240.00000,   0.     ,
           0.     ,   0.     ,   1.     ,   0.     ]
"""


# As Kalibr writes it.
CAMCHAIN = f"""cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.281, 0.0725, 0.00121, -0.00087]
  distortion_model: radtan
  intrinsics: [533.51, 534.02, 341.72, 233.91]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - {X_RL[0].tolist()}
  - {X_RL[1].tolist()}
  - {X_RL[2].tolist()}
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [-0.281, 0.0725, 0.00121, -0.00087]
  distortion_model: radtan
  intrinsics: [533.51, 534.02, 341.72, 233.91]
  resolution: [640, 480]
  rostopic: /cam1/image_raw
"""


def cameras(lens="pinhole", count=2):
    kind, distortion = LENSES[lens]
    left = CameraModel(K, distortion, np.eye(4), 640, 480, kind)
    right = CameraModel(K * [[1.01, 1.0, 1.0], [1.0, 1.01, 1.0], [1.0, 1.0, 1.0]], distortion, X_RL, 640, 480, kind)
    return dict(list({"camera_left": left, "camera_right": right}.items())[:count])


def assert_same(found, expected, atol=1e-9):
    assert list(found) == list(expected)
    for name, camera in expected.items():
        np.testing.assert_allclose(found[name].project(POINTS), camera.project(POINTS), atol=atol)


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize(
    ("form", "file"),
    [("opencv", "a.yml"), ("opencv", "a.xml"), ("opencv", "a.json"), ("ros", "a.yaml"), ("kalibr", "a.yaml")],
)
def test_there_and_back(tmp_path, form, file, count, lens):
    if form == "kalibr" and lens == "rational":
        with pytest.raises(DrakeTrackerError, match="--format kalibr: camera_left has more coefficients"):
            save_foreign(tmp_path / file, cameras(lens, count), form)
        return
    paths = save_foreign(tmp_path / file, cameras(lens, count), form)
    names = ["a_left.yaml", "a_right.yaml"] if (form, count) == ("ros", 2) else [file]
    assert [path.name for path in paths] == names
    found, kind = load_cameras(paths)
    assert kind == form and all((camera.width, camera.height) == (640, 480) for camera in found.values())
    assert_same(found, cameras(lens, count))


def test_opencv_itself_reads_what_is_written(tmp_path):
    (path,) = save_foreign(tmp_path / "a.yml", cameras(), "opencv")
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(file.getNode("M1").mat(), K)
    np.testing.assert_array_equal(file.getNode("R").mat(), X_RL[:3, :3])
    np.testing.assert_array_equal(file.getNode("T").mat().ravel(), X_RL[:3, 3])
    assert file.getNode("D2").mat().shape == (1, 5) and file.getNode("image_width").real() == 640


def stored(folder, **texts):
    paths = []
    for name, text in texts.items():
        paths.append(folder / name.replace("_", "."))
        paths[-1].write_text(text)
    return paths


def test_opencv_stereo_sample_in_two_files_or_one(tmp_path):
    left = cameras()["camera_left"]
    expected = {"camera_left": left, "camera_right": CameraModel(K, left.distortion, X_RL, 640, 480)}
    for paths in (
        stored(tmp_path, intrinsics_yml=INTRINSICS, extrinsics_yml=EXTRINSICS),
        stored(tmp_path, both_yml=INTRINSICS + EXTRINSICS.removeprefix("%YAML:1.0\n---\n")),
    ):
        found, kind = load_cameras(paths)
        assert kind == "opencv" and found["camera_left"].width == 0  # these files have no size of the images
        assert_same(found, expected)


def test_opencv_single_camera_as_xml(tmp_path):
    found, _ = load_cameras(stored(tmp_path, camera_xml=SINGLE_XML))
    assert_same(found, cameras(count=1))
    found, _ = load_cameras(
        stored(
            tmp_path,
            fish_xml=SINGLE_XML.replace("model>0<", "model>1<")
            .replace(" 0.</data></d", "</data></d")
            .replace("<rows>5", "<rows>4"),
        )
    )
    assert found["camera_left"].lens == "fisheye" and len(found["camera_left"].distortion) == 4


def test_ros_pair_with_rounded_matrices(tmp_path):
    # Rectification that turns both cameras by .1 rad about y, and the right one by .02 rad more about x.
    c, s = np.cos(0.1), np.sin(0.1)
    R_left = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    R_right = cv2.Rodrigues(np.array([0.02, 0.0, 0.0]))[0] @ R_left
    text = [", ".join(f"{x:.6f}" for x in R.ravel()) for R in (R_left, R_right)]
    found, kind = load_cameras(
        stored(tmp_path, left_yaml=ros("left", text[0]), right_yaml=ros("right", text[1], "-41.50000"))
    )
    X = np.eye(4)
    X[:3, :3] = R_right.T @ R_left
    X[:3, 3] = R_right.T @ [-0.083, 0.0, 0.0]
    assert kind == "ros"
    np.testing.assert_allclose(found["camera_right"].X_CW, X, atol=3e-6)
    np.testing.assert_allclose(found["camera_left"].project(POINTS), cameras()["camera_left"].project(POINTS))


def test_ros_message_that_was_printed(tmp_path):
    text = (
        "header: {frame_id: cam}\nheight: 480\nwidth: 640\ndistortion_model: rational_polynomial\n"
        f"d: {LENSES['rational'][1]}\nk: {K.ravel().tolist()}\nr: {np.eye(3).ravel().tolist()}\np: {[1.0] * 12}\n"
    )
    assert_same(load_cameras(stored(tmp_path, a_yaml=text))[0], cameras("rational", 1))


def test_kalibr_camchain(tmp_path):
    found, kind = load_cameras(stored(tmp_path, camchain_yaml=CAMCHAIN))
    assert kind == "kalibr"
    left = cameras()["camera_left"]
    assert_same(found, {"camera_left": left, "camera_right": CameraModel(K, left.distortion, X_RL, 640, 480)})


def edited(text, old, new):
    assert old in text
    return text.replace(old, new, 1)


LEFT, RIGHT = ros("left"), ros("right", Tx="-41.50000")


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        ([INTRINSICS], "R and T are missing, the pose of the second camera; give the file with the extrinsics"),
        ([EXTRINSICS], "camera_matrix and distortion_coefficients are missing"),
        ([INTRINSICS, LEFT], "b.yaml is a file of ROS, "),
        (
            [edited(INTRINSICS, "0.,\n       0., 0., 0., 0. ]", "0.,\n       0., 0., 0.1, 0. ]"), EXTRINSICS],
            "thin prism or a tilted",
        ),
        ([edited(INTRINSICS, "cols: 14", "cols: 13"), EXTRINSICS], "D1 must contain only finite numbers"),
        ([edited(INTRINSICS, "5.3351e+02", ".Nan"), EXTRINSICS], "M1 must contain 3 x 3 finite numbers"),
        ([edited(INTRINSICS, "rows: 3", "rows: 1000000000000"), EXTRINSICS], "M1 must contain 3 x 3 finite numbers"),
        ([INTRINSICS, edited(EXTRINSICS, str(X_RL[0, 0]), "0.5")], "R must be a rotation"),
        ([INTRINSICS[:60]], "a.yaml line "),
        ([edited(SINGLE_XML, "</opencv_storage>", "")], "this is not XML"),
        (['<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "c">]><opencv_storage/>'], "XML with a document type"),
        ([edited(SINGLE_XML, "<image_width>640", "<image_width>-640")], "the image size is -640 x 480"),
        ([LEFT, ros("right")], "projection_matrix has no distance to the other camera"),
        ([edited(LEFT, "plumb_bob", "cubic"), RIGHT], "distortion_model is 'cubic'; it must be one of plumb_bob"),
        ([edited(LEFT, "image_height", "image_hight"), RIGHT], "image_height is missing"),
        ([edited(LEFT, "533.51000,", "-533.51,"), RIGHT], "camera_left.K must be"),
        ([LEFT, edited(RIGHT, "500.00000,   0.     , 330", "0.00000,   0.     , 330")], "focal lengths above 0"),
        ([edited(CAMCHAIN, "model: pinhole", "model: omni")], "cam0.camera_model is 'omni'; only pinhole"),
        ([edited(CAMCHAIN, "radtan", "fov")], "cam0.distortion_model is 'fov'; it must be radtan, equidistant or none"),
        ([edited(CAMCHAIN, "T_cn_cnm1", "T_cam_imu")], "cam1.T_cn_cnm1 must contain 4 x 4 finite numbers"),
        ([CAMCHAIN, CAMCHAIN], "one file of Kalibr contains all cameras; give one"),
        (["a: [1, 2]\n"], "not a calibration of drake-tracker"),
        (["- 1\n"], "not a calibration of drake-tracker"),
        (["\x00\x01"], "a.yaml: this is not YAML"),
        (["x: &a [1, 2]\n" + "M1: " + "[" * 300], "nested too deeply"),
        (["%YAML:1.0\n---\na: !!python/object/apply:os.system ['touch ran']\n"], "a.yaml line 2: "),
    ],
)
def test_a_broken_file_is_one_line(tmp_path, monkeypatch, texts, message):
    monkeypatch.chdir(tmp_path)
    paths = stored(tmp_path, **dict(zip(("a_yaml", "b_yaml"), texts)))
    with pytest.raises(DrakeTrackerError) as error:
        load_cameras([path.name for path in paths])
    (line,) = str(error.value).splitlines()
    assert message in line
    assert not (tmp_path / "ran").exists()


def test_wrong_number_of_files(tmp_path):
    for paths in (["a", "a"], ["a", "b", "c"]):
        with pytest.raises(DrakeTrackerError, match="give one file, or two different ones"):
            load_cameras(paths)
    with pytest.raises(DrakeTrackerError, match="nowhere.yml: the calibration cannot be read"):
        load_cameras([tmp_path / "nowhere.yml"])
    assert FORMATS[0] == "drake"


MESSAGE = (
    "header: {frame_id: cam}\nheight: 960\nwidth: 1280\ndistortion_model: plumb_bob\n"
    f"d: {LENSES['pinhole'][1]}\nk: [1000.0, 0.0, 650.0, 0.0, 1010.0, 470.0, 0.0, 0.0, 1.0]\n"
    "r: [1, 0, 0, 0, 1, 0, 0, 0, 1]\np: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]\n"
)


@pytest.mark.parametrize(
    ("added", "size", "expected"),
    [
        ("binning_x: 0\nbinning_y: 0\nroi: {x_offset: 0, y_offset: 0, height: 0, width: 0}\n", (1280, 960),
         (1000.0, 1010.0, 650.0, 470.0)),
        ("binning_x: 2\nbinning_y: 2\n", (640, 480), (500.0, 505.0, 324.75, 234.75)),
        ("roi: {x_offset: 200, y_offset: 100, height: 600, width: 800, do_rectify: false}\n", (800, 600),
         (1000.0, 1010.0, 450.0, 370.0)),
        ("binning_x: 4\nbinning_y: 2\nroi: {x_offset: 200, y_offset: 100, height: 600, width: 800}\n", (200, 300),
         (250.0, 505.0, 112.125, 184.75)),
    ],
)  # fmt: skip
def test_binning_and_region_of_interest_of_ros(tmp_path, added, size, expected):
    camera = load_cameras(stored(tmp_path, a_yaml=MESSAGE + added))[0]["camera_left"]
    assert (camera.width, camera.height) == size
    assert (camera.K[0, 0], camera.K[1, 1], camera.K[0, 2], camera.K[1, 2]) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("added", "message"),
    [
        ("roi: {x_offset: 1000, width: 800}\n", "roi.x_offset, roi.width and binning_x are 1000, 800, 1; they must be"),
        ("binning_y: -2\n", "roi.y_offset, roi.height and binning_y are 0, 960, -2; they must be whole"),
        ("binning_x: 2000\n", "binning_x is 2000 for a region of 1280 px"),
        ("roi: 7\n", "roi must have x_offset, y_offset, width and height"),
    ],
)
def test_a_region_that_no_image_has_is_refused(tmp_path, added, message):
    with pytest.raises(DrakeTrackerError, match=message):
        load_cameras(stored(tmp_path, a_yaml=MESSAGE + added))


def test_messages_of_ros2_topic_echo_and_of_simulators(tmp_path):
    straight = MESSAGE.replace(f"d: {LENSES['pinhole'][1]}", "d: []")
    for text in (f"---\n{straight}---\n", f"{straight}---\n{straight}---\n", straight.replace("plumb_bob", "''")):
        camera = load_cameras(stored(tmp_path, a_yaml=text))[0]["camera_left"]
        assert camera.K[0, 2] == 650.0 and not camera.distortion.any()


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("ost.txt", "# oST version 5.0 parameters\n\n\n[image]\n\nwidth\n640\n\nheight\n480\n", "give the .yaml file"),
        ("a.toml", '[cam_0]\nname = "left"\nsize = [ 640, 480,]\nmatrix = [ [ 500.0,\n', "not a calibration of"),
        ("a.yaml", "focal: 500\ncx: 320\n", r"not a calibration of .*; it has focal, cx"),
    ],
)
def test_files_that_are_no_calibration_are_named(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(DrakeTrackerError, match=f"{name}: .*{message}") as caught:
        load_cameras([tmp_path / name])
    assert "\n" not in str(caught.value)

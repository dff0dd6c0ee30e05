"""A chessboard in front of the cameras: the rendered views from which the cameras are calibrated."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from pydrake.geometry import Box, GeometryInstance, PerceptionProperties
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import RigidBody, SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.cameras.boards.chessboard import Chessboard, draw_board
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.world.config import CamerasConfig, LightingConfig
from drake_tracker.world.imaging.camera_system import add_cameras

BOARD_THICKNESS = 0.004
"""Thickness of the board [m]: its squares lie this far above the table."""


class CalibrationScene:
    """A chessboard and the two cameras, in their own diagram. The board floats where it is put.

    Args:
        board: the chessboard.
        cameras: where the cameras stand, their images and their noise.
        lighting: the lamps.
        seed: of the sensor noise.
    """

    def __init__(self, *, board: Chessboard, cameras: CamerasConfig, lighting: LightingConfig, seed: int = 0) -> None:
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        self._body = plant.AddRigidBody("board", SpatialInertia.SolidBoxWithMass(1.0, 1.0, 1.0, 0.01))
        self._plant = plant
        with tempfile.TemporaryDirectory() as folder:
            paint_board(plant, self._body, board, folder)
            plant.Finalize()
            self._cameras = add_cameras(builder, scene_graph=scene_graph, config=cameras, lighting=lighting, seed=seed)
        self._diagram = builder.Build()

    def render(self, name: str, X_WB: RigidTransform, frame: int = 0) -> np.ndarray:
        """Returns the grey image (h, w) of the board in one camera.

        Args:
            name: of the camera.
            X_WB: pose of the board.
            frame: number of the image; each has its own sensor noise.
        """
        context = self._diagram.CreateDefaultContext()
        context.SetTime(frame * VISION_PERIOD)
        self._plant.SetFreeBodyPose(self._plant.GetMyContextFromRoot(context), self._body, X_WB)
        port = self._cameras[name].image_port
        image = port.Eval(port.get_system().GetMyContextFromRoot(context)).data
        return cv2.cvtColor(image, cv2.COLOR_RGBA2GRAY)


def lying_pose(board: Chessboard, centre: Sequence[float] | np.ndarray, yaw: float) -> RigidTransform:
    """Returns X_WB of a board that lies face up.

    Args:
        board: the chessboard.
        centre: its middle (3,) [m, W].
        yaw: rotation about z_W [rad].
    """
    R_WB = RotationMatrix.MakeZRotation(yaw) @ RotationMatrix.MakeXRotation(np.pi)
    return _centred(board, R_WB, centre)


def held_pose(
    board: Chessboard,
    *,
    X_WC: RigidTransform,
    centre: Sequence[float] | np.ndarray,
    tilt: Sequence[float] | np.ndarray,
    roll: float,
) -> RigidTransform:
    """Returns X_WB of a board that is held in front of a camera.

    The board faces along the camera's axis, is rotated about its normal, and is then tilted.

    Args:
        board: the chessboard.
        X_WC: pose of the camera.
        centre: middle of the board (3,) [m, W].
        tilt: rotations (2,) about the camera's x and y axes [rad].
        roll: rotation about the board's normal [rad].
    """
    R_CB = (
        RotationMatrix.MakeXRotation(tilt[0])
        @ RotationMatrix.MakeYRotation(tilt[1])
        @ RotationMatrix.MakeZRotation(roll)
    )
    return _centred(board, X_WC.rotation() @ R_CB, centre)


def paint_board(
    plant: MultibodyPlant, body: RigidBody, board: Chessboard, folder: str, X_PB: RigidTransform = RigidTransform()
) -> None:
    """Adds to a body a plate with the squares and a white margin of one square.

    Args:
        plant: not yet finalized.
        body: that carries the board.
        board: the chessboard.
        folder: in which the picture of the squares is kept until the renderer has read it.
        X_PB: pose of the board in the frame of the body.
    """
    picture = Path(folder) / "board.png"
    cv2.imwrite(str(picture), draw_board(board))
    size = np.array([board.columns + 3, board.rows + 3]) * board.square
    X_BG = RigidTransform([*board.points()[:, :2].mean(axis=0), BOARD_THICKNESS / 2.0])
    instance = GeometryInstance(X_PB @ X_BG, Box(*size, BOARD_THICKNESS), "board")
    properties = PerceptionProperties()
    properties.AddProperty("phong", "diffuse_map", str(picture))
    instance.set_perception_properties(properties)
    plant.RegisterVisualGeometry(body, instance)


def _centred(board: Chessboard, R_WB: RotationMatrix, centre: Sequence[float] | np.ndarray) -> RigidTransform:
    middle = board.points().mean(axis=0)
    return RigidTransform(R_WB, np.asarray(centre, dtype=float) - R_WB @ middle)

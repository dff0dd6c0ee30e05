"""A chessboard in front of the cameras: the rendered views from which they are calibrated."""

import tempfile
from pathlib import Path

import cv2
import numpy as np
from pydrake.geometry import Box, GeometryInstance, PerceptionProperties
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.vision.chessboard import draw_board
from drake_tracker.world.cameras import add_cameras

BOARD_THICKNESS = 0.004
"""Thickness of the board [m]: its squares lie that far above the table."""


class CalibrationScene:
    """A chessboard and the two cameras, in a diagram of their own. The board floats where it is put.

    Parameters:
        board: the `Chessboard`.
        cameras, lighting: the scenario's ``cameras`` and ``lighting``.
        seed: seed of the sensor noise.
    """

    def __init__(self, board, cameras, lighting, seed=0):
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        self._body = plant.AddRigidBody("board", SpatialInertia.SolidBoxWithMass(1.0, 1.0, 1.0, 0.01))
        self._plant = plant
        with tempfile.TemporaryDirectory() as folder:
            _paint_board(plant, self._body, board, folder)
            plant.Finalize()
            self._cameras = add_cameras(builder, scene_graph, cameras, lighting, seed=seed)
        self._diagram = builder.Build()

    def render(self, name, X_WB, frame=0):
        """Returns the grey image (h, w) that the camera ``name`` takes of the board at pose ``X_WB``.

        ``frame`` counts the images, so that each has sensor noise of its own.
        """
        context = self._diagram.CreateDefaultContext()
        context.SetTime(frame * VISION_PERIOD)
        self._plant.SetFreeBodyPose(self._plant.GetMyContextFromRoot(context), self._body, X_WB)
        port = self._cameras[name].image_port
        image = port.Eval(port.get_system().GetMyContextFromRoot(context)).data
        return cv2.cvtColor(image, cv2.COLOR_RGBA2GRAY)


def _paint_board(plant, body, board, folder):
    """Gives ``body``, whose frame is the board's B, a plate with the squares and a white margin of one square."""
    picture = Path(folder) / "board.png"
    cv2.imwrite(str(picture), draw_board(board))
    size = np.array([board.columns + 3, board.rows + 3]) * board.square
    X_BG = RigidTransform([*board.corners()[:, :2].mean(axis=0), BOARD_THICKNESS / 2.0])
    instance = GeometryInstance(X_BG, Box(*size, BOARD_THICKNESS), "board")
    properties = PerceptionProperties()
    properties.AddProperty("phong", "diffuse_map", str(picture))
    instance.set_perception_properties(properties)
    plant.RegisterVisualGeometry(body, instance)


def lying_pose(board, centre, yaw):
    """Returns X_WB of a board lying face up, its middle at ``centre`` (3,) [m, W], turned by ``yaw`` [rad] about z."""
    R_WB = RotationMatrix.MakeZRotation(yaw) @ RotationMatrix.MakeXRotation(np.pi)
    return _centred(board, R_WB, centre)


def held_pose(board, X_WC, centre, tilt, roll):
    """Returns X_WB of a board held before a camera, its middle at ``centre`` (3,) [m, W].

    The board faces along the camera's axis, then is turned by ``roll`` [rad] about its normal and tilted by ``tilt``
    (2,) [rad] about the camera's x and y axes.
    """
    R_CB = (
        RotationMatrix.MakeXRotation(tilt[0])
        @ RotationMatrix.MakeYRotation(tilt[1])
        @ RotationMatrix.MakeZRotation(roll)
    )
    return _centred(board, X_WC.rotation() @ R_CB, centre)


def _centred(board, R_WB, centre):
    middle = board.corners().mean(axis=0)
    return RigidTransform(R_WB, np.asarray(centre, dtype=float) - R_WB @ middle)

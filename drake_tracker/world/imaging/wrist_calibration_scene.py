"""The arm over a chessboard on the table: the views from which the camera on the hand is calibrated."""

import tempfile

import cv2
import numpy as np
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.arm.description import ArmDescription
from drake_tracker.arm.plant import add_arm
from drake_tracker.cameras.boards.chessboard import Chessboard
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.world.config import CamerasConfig, LightingConfig, WristCamera
from drake_tracker.world.imaging.calibration_board import BOARD_THICKNESS, lying_pose, paint_board
from drake_tracker.world.imaging.camera_system import add_camera, add_renderer
from drake_tracker.world.imaging.lighting import render_engine_params
from drake_tracker.world.imaging.wrist_camera import WRIST_CAMERA, hand_mount, wrist_optics
from drake_tracker.world.train.plant import add_table


class WristCalibrationScene:
    """The arm, its camera, and a chessboard on the table, in their own diagram. The arm stands where it is put.

    Args:
        description: the arm and its hand.
        board: the chessboard.
        place: middle of the board on the table (x, y) [m, W].
        yaw: of the board about z_W [rad].
        cameras: at what the fixed cameras look, beside which the lamps are.
        wrist: the camera on the hand.
        lighting: the lamps.
        table_height: height of the table's top in W [m].
        seed: of the sensor noise.
    """

    def __init__(
        self,
        *,
        description: ArmDescription,
        board: Chessboard,
        place: tuple[float, float],
        yaw: float,
        cameras: CamerasConfig,
        wrist: WristCamera,
        lighting: LightingConfig,
        table_height: float,
        seed: int = 0,
    ) -> None:
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        parts = add_arm(plant, description=description)
        add_table(plant, height=table_height)
        self.X_WB = lying_pose(board, [*place, table_height + BOARD_THICKNESS], yaw)
        with tempfile.TemporaryDirectory() as folder:
            paint_board(plant, plant.world_body(), board, folder, self.X_WB)
            plant.Finalize()
            parent, X_PT = hand_mount(plant, parts.gripper, description.tool_frame)
            params = render_engine_params(lighting, azimuths_deg=cameras.azimuth_deg, look_at=cameras.look_at)
            add_renderer(scene_graph, params=params)
            optics = wrist_optics(wrist, lighting, parent=parent, X_PT=X_PT, seed=seed)
            camera = add_camera(builder, scene_graph=scene_graph, name=WRIST_CAMERA, optics=optics)
        self._plant, self._arm, self._port = plant, parts.arm, camera.image_port
        self._fingers = [plant.GetJointByName(name, parts.gripper) for name in description.fingers]
        self._diagram = builder.Build()

    def render(self, q: np.ndarray, jaw_width: float, frame: int = 0) -> np.ndarray:
        """Returns the grey image (h, w) of the camera on the hand.

        Args:
            q: joints of the arm, shape (n,) [rad].
            jaw_width: opening of the jaws [m].
            frame: number of the image; each has its own sensor noise.
        """
        context = self._diagram.CreateDefaultContext()
        context.SetTime(frame * VISION_PERIOD)
        plant_context = self._plant.GetMyContextFromRoot(context)
        self._plant.SetPositions(plant_context, self._arm, q)
        for finger in self._fingers:
            finger.set_translation(plant_context, 0.5 * jaw_width)
        image = self._port.Eval(self._port.get_system().GetMyContextFromRoot(context)).data
        return cv2.cvtColor(image, cv2.COLOR_RGBA2GRAY)

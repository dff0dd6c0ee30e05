"""The one camera that watches the board: placed at random, anywhere from which the whole face is in view.

A configuration is any object with the fields of a scenario's ``camera``: width, height [px], fov_deg (vertical), noise
[grey levels], azimuth_range_deg (to either side of x_W, from where it looks back towards the arm), elevation_range_deg
(low, high), distance_range (near, far) [m] from the middle of the board, roll_range_deg (to either side).
"""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import LightParameter, MakeRenderEngineVtk
from pydrake.math import RigidTransform, RotationMatrix

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.ball_board import CIRCLE_RADIUS, CIRCLES, face_corners
from drake_tracker.world.ball_board_visual import WALL_HEIGHT
from drake_tracker.world.cameras import RENDERER_NAME, add_camera, camera_pose, true_camera_model
from drake_tracker.world.lighting import render_engine_params

NAME = "camera"
MARGIN = 4.0
"""The board's corners keep this far [px] from the image's edges."""
LAMP_ELEVATION_DEG = 62.0
"""Of the lamps: light from the ceiling (section 4: "standard overhead fluorescent lighting")."""
LAMPS_APART_DEG = 100.0
BOUNCE = 0.35
"""Brightness of what the white board throws back: without it the ball's underside would be black."""
LAMP_BRIGHTNESS = 0.66
"""With this a white board comes out at about 200 grey levels: white on white, and not yet clipped."""
_STREAM = 35
_TRIES = 1000


@dataclass(frozen=True)
class Lamps:
    """What `lighting.make_lights` asks of a rig of cameras: azimuths (left, right) [deg] and the point to light [m]."""

    azimuth_deg: tuple
    look_at: tuple


def draw_camera_pose(config, board, X_WB, seed):
    """Returns X_WC of the camera as drawn from the seed, again and again until it sees the whole face of the board.

    Section 3: "the only constraint on its placement is that the entire face of the board must be in the field of view".
    The circles must not hide behind a wall either, which the board of the paper may not have had.
    Raises DrakeTrackerError when none of 1000 places does.
    """
    rng = np.random.default_rng([seed, _STREAM])
    corners = face_corners(board)
    look_at = X_WB @ corners.mean(axis=0)
    for _ in range(_TRIES):
        azimuth_deg = rng.uniform(-config.azimuth_range_deg, config.azimuth_range_deg)
        elevation_deg, distance = rng.uniform(*config.elevation_range_deg), rng.uniform(*config.distance_range)
        roll = np.deg2rad(rng.uniform(-config.roll_range_deg, config.roll_range_deg))
        X_WC = camera_pose(azimuth_deg, elevation_deg, distance, look_at)
        X_WC = X_WC @ RigidTransform(RotationMatrix.MakeZRotation(roll), np.zeros(3))
        over_the_walls = not board.walls or clears_walls(X_WB.inverse() @ X_WC.translation(), board)
        if over_the_walls and in_view(true_camera_model(config, X_WC), X_WB.multiply(corners.T).T):
            return X_WC
    raise DrakeTrackerError(
        f"camera: from none of {_TRIES} places drawn is the whole board in view; widen camera.fov_deg "
        f"({config.fov_deg:g}) or camera.distance_range"
    )


def in_view(camera, points):
    """Whether points (n, 3) [m, W] lie in the image of a CameraModel with `MARGIN` to spare."""
    pixels = camera.project(points)
    size = np.array([camera.width, camera.height])
    return bool(np.all(pixels >= MARGIN) and np.all(pixels <= size - 1 - MARGIN))


def clears_walls(p_BC, board):
    """Whether a camera at p_BC [m] sees all of the four circles over the walls along the board's sides."""
    for side in (-1.0, 1.0):
        beyond = side * p_BC[0] - 0.5 * board.width
        to_wall = 0.5 * board.width - (max(abs(x) for x, _ in CIRCLES) + CIRCLE_RADIUS)
        if beyond > 0.0 and p_BC[2] * to_wall / (to_wall + beyond) < WALL_HEIGHT:
            return False
    return True


def add_ball_camera(builder, scene_graph, config, lighting, X_WC, look_at, *, window=None, seed=0):
    """Adds the camera, named "camera", at X_WC to a diagram, and its renderer with the lamps over the board.

    ``look_at`` [m, W] is the middle of the board; window, seed as for `add_camera`. Returns Camera.
    """
    lamps = overhead_lamps(look_at)
    params = render_engine_params(lighting, lamps, LAMP_ELEVATION_DEG, LAMP_BRIGHTNESS)
    if not lighting.shadows:  # a lamp under the board would be in its shadow
        params.lights = [*params.lights, _bounce()]
    scene_graph.AddRenderer(RENDERER_NAME, MakeRenderEngineVtk(params))
    return add_camera(
        builder, scene_graph, NAME, X_WC, config, lighting, window=window, supersampling=config.supersampling, seed=seed
    )


def overhead_lamps(look_at):
    """Returns the `Lamps` of the laboratory: they hang where they hang, wherever the camera is put."""
    return Lamps((0.5 * LAMPS_APART_DEG, -0.5 * LAMPS_APART_DEG), tuple(look_at))


def _bounce():
    return LightParameter(type="directional", frame="world", direction=[0.0, 0.0, 1.0], intensity=BOUNCE)

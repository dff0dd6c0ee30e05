"""The lamps: light sources for Drake's VTK renderer.

A configuration is any object with the fields of a scenario's ``lighting``: side, shadows (flicker is a matter of the
sensor, see `SensorNoiseSystem`, because a render engine's lights cannot change during a run).
"""

import numpy as np
from pydrake.geometry import LightParameter, RenderEngineVtkParams

from drake_tracker.errors import DrakeTrackerError

LIGHT_SIDES = ("cameras", "one_side")
_ELEVATION_DEG = 30.0
_OUTWARD_DEG = 15.0
"""How far outside the cameras their lamps stand: the faces between the two get light from both, the others from one."""
_DISTANCE = 2.5
_CONE_ANGLE_DEG = 35.0
_SHADOW_MAP_SIZE = 1024


def _lamp(azimuth_deg, intensity, look_at):
    """Returns a spot light that shines on ``look_at`` (3,) [m, W] from the direction ``azimuth_deg`` about z."""
    azimuth, elevation = np.deg2rad([azimuth_deg, _ELEVATION_DEG])
    towards_lamp = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    return LightParameter(
        type="spot",
        frame="world",
        position=np.asarray(look_at, dtype=float) + _DISTANCE * towards_lamp,
        direction=-towards_lamp,
        cone_angle=_CONE_ANGLE_DEG,
        intensity=intensity,
    )


def make_lights(side, cameras):
    """Returns the list of `LightParameter` for the side the light comes from.

    "cameras": a lamp beside each camera, so that all faces that the cameras see are lit alike. "one_side": one lamp to
    the left of both cameras, and beside the right one a faint one for the light that the walls of a room throw back.

    ``cameras`` is the scenario's ``cameras`` (azimuth_deg, look_at). Raises DrakeTrackerError on another side.
    """
    left, right = cameras.azimuth_deg
    outward = _OUTWARD_DEG if left > right else -_OUTWARD_DEG
    if side == "cameras":
        return [_lamp(left + outward, 0.85, cameras.look_at), _lamp(right - outward, 0.85, cameras.look_at)]
    if side == "one_side":
        return [_lamp(left + 3.0 * outward, 1.2, cameras.look_at), _lamp(right - outward, 0.2, cameras.look_at)]
    raise DrakeTrackerError(f"lighting.side is {side!r}; it must be one of {', '.join(LIGHT_SIDES)}")


def render_engine_params(lighting, cameras):
    """Returns the `RenderEngineVtkParams` for the scenario's ``lighting`` and ``cameras``."""
    return RenderEngineVtkParams(
        default_clear_color=[0.10, 0.11, 0.13],
        lights=make_lights(lighting.side, cameras),
        cast_shadows=lighting.shadows,
        shadow_map_size=_SHADOW_MAP_SIZE,
    )

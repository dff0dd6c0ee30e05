"""The lamps: light sources for Drake's VTK renderer.

A configuration is any object with the fields of a scenario's ``lighting``: side, shadows (flicker is a matter of the
sensor, see `SensorNoiseSystem`, because a render engine's lights cannot change during a run).
"""

import numpy as np
from pydrake.geometry import LightParameter, RenderEngineVtkParams

from drake_tracker.core.errors import DrakeTrackerError

LIGHT_SIDES = ("cameras", "one_side")
ELEVATION_DEG = 30.0
"""Of the lamps above the horizon, unless they hang elsewhere."""
_OUTWARD_DEG = 15.0
"""How far outside the cameras their lamps stand: the faces between the two get light from both, the others from one."""
_SPOT_DISTANCE = 2.5
_SPOT_CONE_DEG = 35.0
_SHADOW_MAP_SIZE = 1024
_PBR_INTENSITY = 1.8
"""Intensity with which physically based shading comes out about as bright as Phong's."""


def _lamp(azimuth_deg, elevation_deg, intensity, look_at, shadows):
    """Returns a lamp that shines on ``look_at`` (3,) [m, W] from the direction ``azimuth_deg`` about W's z axis,
    ``elevation_deg`` above the horizon.

    A directional light is the cheaper one to render, but its shadow map must span all of the scene, so a lamp that
    casts shadows is a spot light.
    """
    azimuth, elevation = np.deg2rad([azimuth_deg, elevation_deg])
    towards_lamp = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    return LightParameter(
        type="spot" if shadows else "directional",
        frame="world",
        position=np.asarray(look_at, dtype=float) + _SPOT_DISTANCE * towards_lamp,
        direction=-towards_lamp,
        cone_angle=_SPOT_CONE_DEG,
        intensity=intensity * (_PBR_INTENSITY if shadows else 1.0),
    )


def make_lights(lighting, cameras, elevation_deg=ELEVATION_DEG, brightness=1.0):
    """Returns the list of `LightParameter` of the scenario's ``lighting``.

    side "cameras": a lamp beside each camera, so that all faces that the cameras see are lit alike. "one_side": one
    lamp to the left of both cameras, and beside the right one a faint one for the light that a room's walls throw back.

    ``cameras`` is the scenario's ``cameras`` (azimuth_deg, look_at), ``elevation_deg`` the lamps',
    ``brightness`` a factor on all of them. Raises DrakeTrackerError on another side.
    """
    left, right = cameras.azimuth_deg
    outward = _OUTWARD_DEG if left > right else -_OUTWARD_DEG
    if lighting.side == "cameras":
        lamps = ((left + outward, 0.85), (right - outward, 0.85))
    elif lighting.side == "one_side":
        lamps = ((left + 3.0 * outward, 1.2), (right - outward, 0.2))
    else:
        raise DrakeTrackerError(f"lighting.side is {lighting.side!r}; it must be one of {', '.join(LIGHT_SIDES)}")
    return [
        _lamp(azimuth_deg, elevation_deg, brightness * intensity, cameras.look_at, lighting.shadows)
        for azimuth_deg, intensity in lamps
    ]


def render_engine_params(lighting, cameras, elevation_deg=ELEVATION_DEG, brightness=1.0):
    """Returns the `RenderEngineVtkParams` for the scenario's ``lighting`` and ``cameras``; the rest as for lights."""
    return RenderEngineVtkParams(
        default_clear_color=[0.10, 0.11, 0.13],
        lights=make_lights(lighting, cameras, elevation_deg, brightness),
        cast_shadows=lighting.shadows,
        shadow_map_size=_SHADOW_MAP_SIZE,
        # With shadow maps, Phong shading multiplies by a texture twice, which turns a dark table black.
        force_to_pbr=lighting.shadows,
    )

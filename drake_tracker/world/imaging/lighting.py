"""The lamps: light sources for Drake's VTK renderer.

Flicker is added by `SensorNoiseSystem`, because the lights of a render engine cannot change during a run.
"""

from collections.abc import Sequence

import numpy as np
from pydrake.geometry import LightParameter, RenderEngineVtkParams

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.config import LIGHT_SIDES, LightingConfig

ELEVATION_DEG = 30.0
"""Elevation of the lamps above the horizontal, unless given otherwise."""
OVERHEAD_ELEVATION_DEG = 62.0
"""Elevation of the lamps over the board (section 4: "standard overhead fluorescent lighting")."""
OVERHEAD_AZIMUTHS_DEG = (50.0, -50.0)
"""Azimuths of the lamps over the board; they hang there wherever the camera stands."""
OVERHEAD_BRIGHTNESS = 0.66
"""With this brightness a white board comes out at about 200 grey levels: white on white, and not yet clipped."""
BOUNCE = 0.35
"""Brightness of the light that the white board reflects; without it the underside of the ball would be black."""
_OUTWARD_DEG = 15.0
"""Angle between a camera and the lamp outside it: the faces between the cameras get light from both lamps, the others
from one."""
_SPOT_DISTANCE = 2.5
_SPOT_CONE_DEG = 35.0
_SHADOW_MAP_SIZE = 1024
_PBR_INTENSITY = 1.8
"""Intensity with which physically based shading comes out about as bright as Phong's."""


def make_lights(
    lighting: LightingConfig,
    *,
    azimuths_deg: Sequence[float],
    look_at: Sequence[float] | np.ndarray,
    elevation_deg: float = ELEVATION_DEG,
    brightness: float = 1.0,
) -> list[LightParameter]:
    """Returns two lamps that shine on a point.

    With side "cameras" there is a lamp beside each camera, so that all faces that the cameras see are lit alike. With
    "one_side", one lamp stands to the left of both cameras, and a faint lamp beside the right camera replaces the light
    that the walls of a laboratory reflect.

    Args:
        lighting: its ``side`` and ``shadows``.
        azimuths_deg: azimuths of the left and the right camera about W's z axis.
        look_at: the point (3,) [m, W].
        elevation_deg: elevation of the lamps above the horizontal.
        brightness: factor on the intensity of all lamps.

    Raises DrakeTrackerError for an unknown side.
    """
    left, right = azimuths_deg
    outward = _OUTWARD_DEG if left > right else -_OUTWARD_DEG
    if lighting.side == "cameras":
        lamps = ((left + outward, 0.85), (right - outward, 0.85))
    elif lighting.side == "one_side":
        lamps = ((left + 3.0 * outward, 1.2), (right - outward, 0.2))
    else:
        raise DrakeTrackerError(f"lighting.side is {lighting.side!r}; it must be one of {', '.join(LIGHT_SIDES)}")
    return [
        _lamp(azimuth_deg, elevation_deg, brightness * intensity, look_at, lighting.shadows)
        for azimuth_deg, intensity in lamps
    ]


def render_engine_params(
    lighting: LightingConfig,
    *,
    azimuths_deg: Sequence[float],
    look_at: Sequence[float] | np.ndarray,
    elevation_deg: float = ELEVATION_DEG,
    brightness: float = 1.0,
) -> RenderEngineVtkParams:
    """Returns the parameters of a renderer with the lamps of `make_lights`, whose arguments it takes."""
    return RenderEngineVtkParams(
        default_clear_color=[0.10, 0.11, 0.13],
        lights=make_lights(
            lighting,
            azimuths_deg=azimuths_deg,
            look_at=look_at,
            elevation_deg=elevation_deg,
            brightness=brightness,
        ),
        cast_shadows=lighting.shadows,
        shadow_map_size=_SHADOW_MAP_SIZE,
        # With shadow maps, Phong shading multiplies by a texture twice, which turns a dark table black.
        force_to_pbr=lighting.shadows,
    )


def overhead_render_engine_params(
    lighting: LightingConfig, look_at: Sequence[float] | np.ndarray
) -> RenderEngineVtkParams:
    """Returns the parameters of a renderer with lamps over a board, whose middle is at ``look_at`` (3,) [m, W]."""
    params = render_engine_params(
        lighting,
        azimuths_deg=OVERHEAD_AZIMUTHS_DEG,
        look_at=look_at,
        elevation_deg=OVERHEAD_ELEVATION_DEG,
        brightness=OVERHEAD_BRIGHTNESS,
    )
    if not lighting.shadows:  # a lamp under the board would be in its shadow
        bounce = LightParameter(type="directional", frame="world", direction=[0.0, 0.0, 1.0], intensity=BOUNCE)
        params.lights = [*params.lights, bounce]
    return params


def _lamp(
    azimuth_deg: float,
    elevation_deg: float,
    intensity: float,
    look_at: Sequence[float] | np.ndarray,
    shadows: bool,
) -> LightParameter:
    """Returns a lamp that shines on ``look_at`` (3,) [m, W] from a direction.

    The direction is given by the azimuth about W's z axis and the elevation above the horizontal. A directional light
    is cheaper to render, but its shadow map must span the whole scene, so a lamp that casts shadows is a spot light.
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

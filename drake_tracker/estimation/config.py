"""Settings of the estimators. The name of a class is its YAML tag; `estimator.py` registers it."""

from dataclasses import dataclass
from typing import ClassVar

from drake_tracker.core.setting import setting


@dataclass(frozen=True)
class ArcLength:
    """The filter of the 1991 paper on arc length and bending (section 4)."""

    mode: str = setting(
        "baseline",
        "chords over m frames, literally over one frame, or in space",
        choices=("baseline", "literal", "space"),
    )
    attenuation: float = setting(30.0, "stopband attenuation of the Kaiser windows", "dB", (0.0, 120.0))
    order: int = setting(30, "order of the moving averages of s and s^2", "", (2, 600))
    anchor_order: int = setting(10, "order of the moving average for the starting point", "", (2, 600))
    heading_order: int = setting(20, "order of the moving average for the direction of its chord", "", (2, 600))
    bending_order: int = setting(40, "order of the moving average of the bending phi", "", (2, 600))
    baseline: int = setting(0, "length m of a chord; 0: chosen from the noise and the speed", "frames", (0, 60))
    baseline_factor: ClassVar[float] = 8.0
    """Length of the chosen chord divided by its noise; chosen."""
    start_sigma: float = setting(0.002, "initial noise of a point, per axis", "m", (0.00001, 0.1))
    systematic_std: float = setting(
        0.005, "standard deviation of the error that the filter cannot observe", "m", (0.0, 0.1)
    )
    min_speed: float = setting(0.02, "speed below which the object is at rest", "m/s", (0.0, 0.5))
    restart_after: float = setting(0.3, "gap between points after which the filter restarts", "s", (0.02, 10.0))
    ready_after: float = setting(0.6, "time span of points needed for a prediction", "s", (0.1, 10.0))


@dataclass(frozen=True)
class AlphaBetaGamma:
    """The earlier filter of the 1991 paper: fixed gains in x, y and z."""

    tracking_index: float = setting(0.001, "manoeuvre noise over measurement noise, x and y", "", (1e-7, 10.0))
    vertical_tracking_index: ClassVar[float] = 1e-5
    """The same for z, which changes little; chosen."""
    systematic_std: float = setting(
        0.006, "standard deviation of the error that the filter cannot observe", "m", (0.0, 0.1)
    )
    min_speed: float = setting(0.02, "speed below which the last heading is held", "m/s", (0.0, 0.5))
    restart_after: float = setting(0.3, "gap between points after which the filter restarts", "s", (0.02, 10.0))
    ready_after: float = setting(0.6, "time span of points needed for a prediction", "s", (0.1, 10.0))


@dataclass(frozen=True)
class CoordinatedTurn:
    """Two extended Kalman filters of an object that moves along an arc of slowly changing speed and curvature: one
    filter expects gentle bends, the other sharp bends. Their predictions are weighted by their past errors."""

    speed_noise: ClassVar[float] = 0.003
    """Least process noise of the speed [m/s/sqrt(s)]; chosen."""
    bend_noise: float = setting(
        8.0, "process noise of the curvature per distance, on gentle bends", "1/m/sqrt(m)", (1e-3, 1000.0)
    )
    sharp_bend_noise: ClassVar[float] = 36.0
    """The same on sharp bends [1/m/sqrt(m)]; chosen."""
    sharp_bend_length: ClassVar[float] = 0.07
    """Mean length of a sharp bend [m]; chosen."""
    start_sigma: float = setting(0.002, "initial noise of a point, per axis", "m", (0.00001, 0.1))
    systematic_std: float = setting(
        0.0, "standard deviation of the error that the filter cannot observe", "m", (0.0, 0.1)
    )
    restart_after: float = setting(1.0, "gap between points after which the filter restarts", "s", (0.02, 10.0))
    ready_after: float = setting(0.3, "time span of points needed for a prediction", "s", (0.1, 10.0))


@dataclass(frozen=True)
class ClosedPath:
    """A filter that detects when the path repeats, learns it, and predicts along it."""

    systematic_std: float = setting(
        0.003, "standard deviation of the error that the filter cannot observe", "m", (0.0, 0.1)
    )


@dataclass(frozen=True)
class InclinedPlane:
    """A filter of a ball that rolls down a board; predicts where and when it leaves the bottom edge."""

    sigma: float = setting(0.0025, "noise of a point, per axis", "m", (0.00001, 0.1))
    process_noise: ClassVar[float] = 0.03
    """Process noise of the velocity [m/s/sqrt(s)]; chosen."""
    hit_speed: ClassVar[float] = 0.4
    """Change of velocity that a peg may cause, per axis [m/s]; chosen."""
    gate: float = setting(
        3.5, "innovation, in standard deviations, above which the ball has hit something", "", (0.5, 20.0)
    )
    restitution: float = setting(0.5, "coefficient of restitution of the walls", "", (0.0, 1.0))


@dataclass(frozen=True)
class Belt:
    """A filter of all parts on a belt, whose speed they share."""

    speed_noise: ClassVar[float] = 0.003
    """Process noise of the belt's speed [m/s/sqrt(s)]; chosen."""
    drift: ClassVar[float] = 0.0005
    """Process noise of the position of a part on the belt [m/sqrt(s)]; chosen."""
    turn_drift: ClassVar[float] = 0.005
    """Process noise of the direction of a part [rad/sqrt(s)]; chosen."""
    encoder_std: ClassVar[float] = 0.0005
    """Standard deviation of the speed that the encoder measures [m/s]; chosen."""
    systematic_std: float = setting(
        0.0004, "standard deviation of the error that the filter cannot observe", "m", (0.0, 0.1)
    )
    forget_after: ClassVar[float] = 0.6
    """Time after which a part that is not seen is forgotten [s]; chosen."""


@dataclass(frozen=True)
class PhaseFilterConfig:
    """The filter of the position along a learned path, which is part of the closed-path estimator."""

    cruise_noise: ClassVar[float] = 5e-5
    """Process noise of the speed while cruising [m/s/sqrt(s)]; chosen."""
    manoeuvre_noise: ClassVar[float] = 0.04
    """Process noise of the acceleration in a gentle manoeuvre [m/s^2/sqrt(s)]; chosen."""
    fading: ClassVar[float] = 1.0
    """Time constant with which that acceleration decays [s]; chosen."""
    stop_noise: ClassVar[float] = 1.0
    """Process noise of the acceleration while stopping or starting [m/s^2/sqrt(s)]; chosen."""
    stop_fading: ClassVar[float] = 0.15
    """Time constant with which that acceleration decays [s]; chosen."""

"""Settings of the estimators. The name of a class is its YAML tag."""

from dataclasses import dataclass

from drake_tracker.core.setting import setting


@dataclass(frozen=True)
class ArcLength:
    """The paper's filter on arc length and bending (section 4)."""

    mode: str = setting("baseline", "chords over m frames, or literally over one", choices=("baseline", "literal"))
    attenuation: float = setting(30.0, "attenuation of the Kaiser windows", "dB", (0.0, 120.0))
    order: int = setting(30, "order of the moving averages of s and its square", "", (2, 600))
    anchor_order: int = setting(10, "order for the starting point", "", (2, 600))
    heading_order: int = setting(20, "order for the direction of its chord", "", (2, 600))
    bending_order: int = setting(40, "order for the bending phi", "", (2, 600))
    baseline: int = setting(0, "frames m of a chord; 0: chosen from the noise and the speed", "frames", (0, 60))
    baseline_factor: float = setting(8.0, "length of the chord chosen, over its noise", "", (1.0, 100.0))
    start_sigma: float = setting(0.002, "noise of a point supposed at first", "m", (0.00001, 0.1))
    systematic_std: float = setting(0.005, "error of a point that the filter cannot see", "m", (0.0, 0.1))
    min_speed: float = setting(0.02, "speed below which the object rests", "m/s", (0.0, 0.5))
    restart_after: float = setting(0.3, "gap between points after which it starts afresh", "s", (0.02, 10.0))
    ready_after: float = setting(0.6, "time span of points needed for a prediction", "s", (0.1, 10.0))


@dataclass(frozen=True)
class AlphaBetaGamma:
    """The authors' earlier Cartesian filter with fixed gains."""

    tracking_index: float = setting(0.001, "manoeuvre over measurement noise in x and y", "", (1e-7, 10.0))
    vertical_tracking_index: float = setting(1e-5, "the same in z, which changes little", "", (1e-7, 10.0))
    systematic_std: float = setting(0.006, "error of a point that the filter cannot see", "m", (0.0, 0.1))
    min_speed: float = setting(0.02, "speed below which the last heading is held", "m/s", (0.0, 0.5))
    restart_after: float = setting(0.3, "gap between points after which it starts afresh", "s", (0.02, 10.0))
    ready_after: float = setting(0.6, "time span of points needed for a prediction", "s", (0.1, 10.0))


@dataclass(frozen=True)
class CoordinatedTurn:
    """An extended Kalman filter of an object that drives and bends as it drives."""

    speed_noise: float = setting(0.003, "how the speed wanders at least", "m/s/sqrt(s)", (1e-6, 1.0))
    bend_noise: float = setting(8.0, "how the curvature wanders with the way", "1/m/sqrt(m)", (1e-3, 1000.0))
    start_sigma: float = setting(0.002, "noise of a point supposed at first", "m", (0.00001, 0.1))
    systematic_std: float = setting(0.0, "error of a point that the filter cannot see", "m", (0.0, 0.1))
    restart_after: float = setting(1.0, "gap between points after which it starts afresh", "s", (0.02, 10.0))
    ready_after: float = setting(0.3, "time span of points needed for a prediction", "s", (0.1, 10.0))


@dataclass(frozen=True)
class ClosedPath:
    """A filter that notices that the path comes round, learns it, and predicts along it."""

    systematic_std: float = setting(0.003, "error of a point that the filter cannot see", "m", (0.0, 0.1))


@dataclass(frozen=True)
class Slope:
    """A filter of a ball that rolls down the board, and where it comes out."""

    sigma: float = setting(0.0025, "noise of a point, per axis", "m", (0.00001, 0.1))
    process_noise: float = setting(0.03, "how the speed wanders", "m/s/sqrt(s)", (1e-6, 10.0))
    hit_speed: float = setting(0.4, "change of speed that a peg may cause, per axis", "m/s", (0.001, 10.0))
    gate: float = setting(3.5, "deviations from what is expected that tell of a hit", "", (0.5, 20.0))
    restitution: float = setting(0.5, "of the walls", "", (0.0, 1.0))

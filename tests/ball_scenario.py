"""A scenario of the ball, as far as the world reads it."""

from types import SimpleNamespace


def make_scenario(seed=0, time_step=1.0 / 600.0, noise=0.0, start_x=None, **board):
    settings = {
        "incline_deg": 10.0,
        "length": 0.90,
        "width": 0.60,
        "edge_position": (0.55, 0.0, 0.50),
        "placement_range": 0.01,
        "rotation_range_deg": 2.0,
        "walls": True,
        "peg_count": -1,
        "placing_std": 0.0005,
        "knock_time": 0.0,
        "distractor": False,
    }
    return SimpleNamespace(
        seed=seed,
        time_step=time_step,
        board=SimpleNamespace(**settings | board),
        ball=SimpleNamespace(start_x=start_x),
        camera=SimpleNamespace(
            width=256,
            height=256,
            fov_deg=45.0,
            noise=noise,
            azimuth_range_deg=50.0,
            elevation_range_deg=(40.0, 65.0),
            distance_range=(1.5, 1.9),
            roll_range_deg=5.0,
        ),
        lighting=SimpleNamespace(side="cameras", shadows=False, flicker=0.0, flicker_hz=100.0),
    )

"""Pictures of a board with circles, and of a shaded white ball on a white board, drawn without a renderer."""

import numpy as np

CIRCLES = np.array([(-0.25, 0.85, 0.0), (0.25, 0.85, 0.0), (0.25, 0.05, 0.0), (-0.22, 0.05, 0.0)])
"""p_BQ of the circles' centres [m]."""
RADIUS = 0.025
WIDTH, LENGTH = 0.60, 0.90
INCLINE = np.radians(10.0)
BALL_RADIUS = 0.020
SIZE = 256
FROM_CAMERA, FROM_SIDE = (0.0, 0.0, 1.0), (-0.4, -0.5, 0.77)
"""Directions towards the light, in (u, v, towards the camera)."""


def intrinsics(size=SIZE, fov_deg=45.0):
    """K of a square image."""
    f = size / 2 / np.tan(np.radians(fov_deg / 2))
    return np.array([[f, 0.0, (size - 1) / 2], [0.0, f, (size - 1) / 2], [0.0, 0.0, 1.0]])


def board_pose():
    """X_WB (4, 4) of the board on its incline."""
    y, z = (np.array(axis) for axis in ((np.cos(INCLINE), 0, np.sin(INCLINE)), (-np.sin(INCLINE), 0, np.cos(INCLINE))))
    X_WB = np.eye(4)
    X_WB[:3, :3] = np.column_stack([np.cross(y, z), y, z])
    X_WB[:3, 3] = 0.55, 0.0, 0.50
    return X_WB


def camera_pose(azimuth_deg=20.0, elevation_deg=52.0, distance=1.7, roll_deg=2.0):
    """X_CB (4, 4) of a camera that stands beyond the board's upper edge and looks at its middle."""
    X_WB = board_pose()
    target = X_WB[:3, 3] + LENGTH / 2 * X_WB[:3, 1]
    azimuth, elevation, roll = np.radians([azimuth_deg, elevation_deg, roll_deg])
    towards = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    x = np.cross(-towards, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    y = np.cross(-towards, x)
    R_WC = np.column_stack([np.cos(roll) * x + np.sin(roll) * y, np.cos(roll) * y - np.sin(roll) * x, -towards])
    X_CW = np.eye(4)
    X_CW[:3, :3] = R_WC.T
    X_CW[:3, 3] = -R_WC.T @ (target + distance * towards)
    return X_CW @ X_WB


def random_camera_pose(rng, size=SIZE):
    """X_CB of a camera placed at random that sees the whole face of the board with 4 px to spare."""
    corners = np.array([(x, y, 0.0) for x in (-WIDTH / 2, WIDTH / 2) for y in (0.0, LENGTH)])
    while True:
        X_CB = camera_pose(rng.uniform(-50, 50), rng.uniform(40, 65), rng.uniform(1.5, 1.9), rng.uniform(-5, 5))
        p_CQ = corners @ X_CB[:3, :3].T + X_CB[:3, 3]
        uv = p_CQ[:, :2] / p_CQ[:, 2:] * intrinsics(size)[0, 0] + (size - 1) / 2
        if (uv > 4.0).all() and (uv < size - 5.0).all():
            return X_CB


def draw_board(X_CB, circles=CIRCLES, size=SIZE, samples=4, floor=70.0, white=205.0, black=20.0):
    """Returns the board's image as grey levels (size, size), each pixel the mean of samples x samples."""
    K = intrinsics(size)
    H = np.linalg.inv(K @ np.column_stack([X_CB[:3, 0], X_CB[:3, 1], X_CB[:3, 3]]))
    side = (np.arange(size * samples, dtype=np.float32) + 0.5) / samples - 0.5
    u, v = side[np.newaxis, :], side[:, np.newaxis]
    w = H[2, 0] * u + H[2, 1] * v + H[2, 2]
    x = (H[0, 0] * u + H[0, 1] * v + H[0, 2]) / w
    y = (H[1, 0] * u + H[1, 1] * v + H[1, 2]) / w
    image = np.where((np.abs(x) < WIDTH / 2) & (y > 0.0) & (y < LENGTH), white, floor)
    for cx, cy, _ in circles:
        image[(x - cx) ** 2 + (y - cy) ** 2 < RADIUS**2] = black
    return image.reshape(size, samples, size, samples).mean(axis=(1, 3))


def put_ball(image, centre, radius=3.8, light=FROM_CAMERA, white=240.0, samples=5):
    """Returns a float image with a matt ball at ``centre`` (u, v) [px], lit from ``light`` and from all around."""
    image = np.array(image, dtype=float)
    u0, v0 = (int(np.floor(value - radius - 2)) for value in centre)
    n = int(2 * radius + 6)
    y, x = np.mgrid[: n * samples, : n * samples]
    x, y = ((first + (a + 0.5) / samples - 0.5 - c) / radius for first, a, c in zip((u0, v0), (x, y), centre))
    z = np.sqrt(np.clip(1.0 - x * x - y * y, 0.0, None))
    lit = np.clip(np.tensordot(np.array(light) / np.linalg.norm(light), [x, y, z], 1), 0.0, None)
    behind = image[v0 : v0 + n, u0 : u0 + n].repeat(samples, 0).repeat(samples, 1)
    seen = np.where(x * x + y * y < 1.0, white * (0.45 + 0.55 * lit), behind)
    image[v0 : v0 + n, u0 : u0 + n] = seen.reshape(n, samples, n, samples).mean(axis=(1, 3))
    return image


def shoot(image, rng, noise=2.0, gain=1.0):
    """Returns what a camera makes of a picture: uint8 with noise [grey], under a light ``gain`` times as strong."""
    return np.clip(np.rint(gain * image + rng.normal(scale=noise, size=image.shape)), 0, 255).astype(np.uint8)

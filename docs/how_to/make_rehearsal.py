"""Draws what the guide "Your cameras in an hour" films: photographs of a board, two clips, and images of a screen."""

from pathlib import Path

import cv2
import numpy as np

from drake_tracker.cameras.latency import draw_code

WIDTH, HEIGHT, RATE = 640, 480, 30
K = np.array([[760.0, 0.0, 319.5], [0.0, 760.0, 239.5], [0.0, 0.0, 1.0]])
PLACES = {"left": np.array([-0.30, -0.55, 0.55]), "right": np.array([0.30, -0.55, 0.55])}
rng = np.random.default_rng(1)
markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
board = cv2.aruco.CharucoBoard((8, 6), 0.03, 0.0225, markers).generateImage(
    (1240, 940), marginSize=20
)  # 0.2 mm a pixel
table = cv2.GaussianBlur(rng.uniform(0, 255, (HEIGHT, WIDTH)), (0, 0), 4) * 4 - 400  # a texture


def world_to_camera(place):
    """Returns R_CW and p_CoWo_C of a camera that looks at the middle of the table."""
    z = -place / np.linalg.norm(place)
    x = np.cross(z, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(z, [0.0, 0.0, 1.0]))
    R = np.array([x, np.cross(z, x), z])
    return R, -R @ place


def finish(image):
    return np.clip(cv2.GaussianBlur(image, (0, 0), 0.6) + rng.normal(0.0, 2.0, image.shape), 0, 255).astype(np.uint8)


def photograph(side, turn, p_WB):
    """Returns an image of the board with its middle at p_WB [m], turned by a rotation vector."""
    R_CW, p_C = world_to_camera(PLACES[side])
    R_WB = cv2.Rodrigues(np.array(turn, dtype=float))[0] @ np.diag([1.0, -1.0, -1.0])  # its face is up
    axes = R_CW @ R_WB * 0.0002
    origin = R_CW @ (p_WB - R_WB @ [0.124, 0.094, 0.0]) + p_C
    fine = np.diag([4.0, 4.0, 1.0])  # 4 x 4 samples to a pixel
    fine[:2, 2] = 1.5
    H = fine @ K @ np.column_stack([axes[:, 0], axes[:, 1], origin])
    image = cv2.resize(np.clip(table, 60, 140), (4 * WIDTH, 4 * HEIGHT))
    cv2.warpPerspective(
        board.astype(float), H, (4 * WIDTH, 4 * HEIGHT), image, cv2.INTER_LINEAR, cv2.BORDER_TRANSPARENT
    )
    return finish(cv2.resize(image, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA))


def film(side, path):
    """Returns an image of a ball of 40 mm for each place [m] of a path."""
    R_CW, p_C = world_to_camera(PLACES[side])
    for p_WQ in path:
        p = R_CW @ p_WQ + p_C
        u, v = (K @ p)[:2] / p[2]
        image = np.clip(table, 60, 140)
        cv2.circle(image, (round(16 * u), round(16 * v)), round(16 * 760 * 0.02 / p[2]), 225, -1, cv2.LINE_AA, 4)
        yield finish(image)


Path("shots").mkdir()
tilts = [(0.6, 0.0), (0.95, 0.0), (0.25, 0.2), (0.6, 0.45), (0.6, -0.45), (0.9, 0.3), (0.3, -0.3)]
places = [(x, y) for x in (-0.13, 0.0, 0.13) for y in (-0.26, -0.14, 0.0, 0.1)] + [(0.0, -0.3)]
for number in range(1, 15):  # the first one lies on the table, in the middle
    turn = (*tilts[number % 7], 0.25 * (number % 5 - 2)) if number > 1 else (0, 0, 0)
    middle = (*places[number - 2], 0.04 + 0.04 * (number % 3)) if number > 1 else (0, 0, 0)
    for side in PLACES:
        cv2.imwrite(f"shots/{side}{number:02d}.png", photograph(side, turn, np.array(middle)))

step = np.linspace(0.0, 1.0, 36)
stroke = 10 * step**3 - 15 * step**4 + 6 * step**5  # from rest to rest
parts = [np.zeros(15), stroke, np.ones(15), 1 - stroke, np.zeros(15), stroke, np.ones(15)]
path = np.array([[-0.1 + 0.2 * s, 0.0, 0.02] for s in np.concatenate(parts)])
for side in PLACES:
    video = cv2.VideoWriter(f"{side}.mp4", cv2.VideoWriter.fourcc(*"mp4v"), RATE, (WIDTH, HEIGHT), isColor=False)
    for image in film(side, path):
        video.write(image)
    video.release()

for side, latency in (("left", 0.045), ("right", 0.062)):  # a screen of 60 Hz, seen by a camera of 29 Hz
    Path(f"screen_{side}").mkdir()
    H = cv2.getPerspectiveTransform(
        np.float32([[0, 0], [310, 0], [310, 170], [0, 170]]), np.float32([[60, 90], [560, 70], [590, 370], [50, 350]])
    )
    for k in range(48):
        shown = int(60 * k / 29.0)  # number of the image of the screen
        fields = [1_700_000_000_000 + round(1e3 * (shown - (shown - j) % 4) / 60) for j in range(4)]
        image = cv2.warpPerspective(draw_code(fields, 10), H, (WIDTH, HEIGHT), flags=cv2.INTER_AREA, borderValue=40)
        stamp = 1_700_000_000 + k / 29.0 + latency
        cv2.imwrite(f"screen_{side}/{stamp:.6f}.png", finish(image.astype(float)))

"""Synthetic clips with known tracks for `footage.py`: a textured background, textured objects, noise, a camera at rest
or not. All of a clip is drawn from its seed."""

import io
from dataclasses import dataclass

import av
import cv2
import numpy as np

WIDTH, HEIGHT, RATE = 640, 480, 30.0
NOISE = 2.0
"""Standard deviation of the noise of a pixel [grey levels]."""
MARGIN = 80
"""Pixels of the background on each side beyond the image, for a camera that moves."""
KINDS = ("plain", "shake", "pan", "rival", "ball", "crossing", "person", "blur", "light", "compressed", "stop")
FAST_KINDS = ("beside", "in front")
"""A small fast ball beside a large slow mover, and one that passes in front of it, for `footage_parts/fast.py`."""
HIDDEN_KINDS = ("hidden",)
"""An object that passes behind a pillar in the middle of the clip, for `footage_parts/hidden.py`."""
EXPOSURE, EXPOSURES = 0.5, 6
"""Time for which the shutter is open, in periods, and the number of instants that are averaged; only with blur."""
QUALITY = 32
"""Rate factor (CRF) of H.264: a small file with visible artefacts."""


@dataclass(frozen=True, eq=False)
class Clip:
    """A clip.

    Attributes:
        images: uint8 (n, h, w).
        truth: (n, objects, 2), centre of each object in each image [px]; the first object is the one to follow.
        size: diameter of the first object [px].
        pillar: first column of a pillar in front of the objects, and the first beyond it.
    """

    images: np.ndarray
    truth: np.ndarray
    size: float
    pillar: tuple[int, int] | None = None


def make_clip(kind, seed, count=120, sky=None, thing=None) -> Clip:
    """Returns a clip of ``count`` images at `RATE`. Background and object are drawn where none are given.

    Args:
        kind: one of `KINDS`, `FAST_KINDS` or `HIDDEN_KINDS`.
        seed: of all that is random.
        count: number of images.
        sky: background, float32 (HEIGHT + 2 MARGIN, WIDTH + 2 MARGIN).
        thing: the object to follow.
    """
    rng = np.random.default_rng([seed, (KINDS + FAST_KINDS + HIDDEN_KINDS).index(kind)])
    drawn = background(rng, WIDTH + 2 * MARGIN, HEIGHT + 2 * MARGIN)
    sky = drawn if sky is None else sky
    camera = np.zeros((count, 2))
    if kind == "shake":
        camera = rng.normal(0.0, 1.0, (count, 2))
    elif kind == "pan":
        angle = rng.uniform(0.0, 2.0 * np.pi)
        camera = 0.5 * np.arange(count)[:, None] * [np.cos(angle), np.sin(angle)]
    objects, paths = _objects(kind, rng, count)
    objects = objects if thing is None else [thing, *objects[1:]]
    pillar, front = None, None
    if kind == "hidden":
        width = int(rng.integers(40, 90))
        pillar = ((WIDTH - width) // 2, (WIDTH + width) // 2)
        front = _texture(rng, width, HEIGHT, rng.uniform(60.0, 160.0), 12.0)
    images = []
    truth = np.array(paths).transpose(1, 0, 2) - camera[:, None]
    steps = np.gradient(truth, axis=0)
    gain = np.ones(count)
    if kind == "light":
        gain += 0.15 * np.sin(2.0 * np.pi * (0.4 / RATE * np.arange(count) + rng.random())) + rng.normal(0, 0.02, count)
    for k in range(count):
        shift = np.float32([[1, 0, -MARGIN - camera[k, 0]], [0, 1, -MARGIN - camera[k, 1]]])
        image = cv2.warpAffine(sky, shift, (WIDTH, HEIGHT), flags=cv2.INTER_LINEAR)
        if kind == "blur":
            offsets = EXPOSURE * np.linspace(-0.5, 0.5, EXPOSURES)
            image = np.mean([_painted(image, objects, truth[k] + at * steps[k], k) for at in offsets], axis=0)
        else:
            image = _painted(image, objects, truth[k], k)
        if pillar is not None:
            image[:, slice(*pillar)] = front
        image = gain[k] * image + rng.normal(0.0, NOISE, image.shape)
        images.append(np.clip(np.rint(image), 0, 255).astype(np.uint8))
    if kind == "compressed":
        images = _compressed(images)
    if kind == "person":
        truth = truth + [[_middle_of_person(k)] for k in range(count)]
    return Clip(np.array(images), truth, float(np.sqrt(4.0 / np.pi * (objects[0].alpha > 0.5).sum())), pillar)


def _painted(image, objects, centres, k):
    """Returns a copy of an image with the objects of image k at ``centres`` (n, 2), the first one in front."""
    image = image.copy()
    for number in reversed(range(len(objects))):
        paint(image, objects[number], centres[number], k)
    return image


def _compressed(images):
    """Returns grey images after H.264 of low quality."""
    buffer = io.BytesIO()
    with av.open(buffer, "w", format="matroska") as container:
        stream = container.add_stream("libx264", rate=round(RATE), options={"crf": str(QUALITY)})
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        stream.codec_context.thread_count = 1
        for image in images:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), "rgb24")))
        container.mux(stream.encode())
    buffer.seek(0)
    with av.open(buffer) as container:
        return [cv2.cvtColor(f.to_ndarray(format="rgb24"), cv2.COLOR_RGB2GRAY) for f in container.decode(video=0)]


def _middle_of_person(k):
    """Returns the centroid of the convex hull of a walking figure, relative to the middle of its drawing (2,) [px]."""
    moments = cv2.moments(cv2.convexHull(cv2.findNonZero((_person(k) > 0.5).astype(np.uint8))))
    return np.array([moments["m10"], moments["m01"]]) / moments["m00"] - 0.5 * np.array([99.0, 159.0])


@dataclass(frozen=True, eq=False)
class _Object:
    """A patch of texture with an opacity; a person has legs and arms that swing."""

    texture: np.ndarray
    alpha: np.ndarray
    person: bool = False


def _texture(rng, width, height, mean, spread):
    """Returns noise of several scales, float32 (h, w)."""
    total = np.zeros((height, width))
    for scale in (4, 12, 40):
        coarse = rng.normal(size=(height // scale + 4, width // scale + 4))
        total += cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    return (mean + spread * total / total.std()).astype(np.float32)


def background(rng, width, height):
    """Returns a texture with 60 sharp-edged shapes in it, as of a room or a street, float32 (h, w)."""
    image = _texture(rng, width, height, 115.0, 15.0)
    for _ in range(60):
        corners = rng.uniform([0, 0], [width, height]) + rng.normal(0.0, 45.0, (4, 2))
        shape = np.zeros((height, width), np.float32)
        cv2.fillConvexPoly(shape, cv2.convexHull(corners.astype(np.int32)), 1.0, cv2.LINE_AA)
        image += shape * rng.uniform(-50.0, 50.0)
    return np.clip(image, 40.0, 190.0)


def disc(rng, diameter, mean):
    """Returns a disc with a texture."""
    side = int(diameter) + 6
    v, u = np.mgrid[:side, :side] - 0.5 * (side - 1)
    alpha = np.clip(0.5 * diameter + 0.5 - np.hypot(u, v), 0.0, 1.0).astype(np.float32)
    return _Object(_texture(rng, side, side, mean, 12.0), alpha)


def paint(image, thing, centre, k):
    """Draws an object into an image, in place; the centre of its patch is at ``centre``."""
    alpha = _person(k) if thing.person else thing.alpha
    h, w = alpha.shape
    u0, v0 = np.floor(centre - 0.5 * np.array([w - 1, h - 1])).astype(int)
    fraction = centre - 0.5 * np.array([w - 1, h - 1]) - (u0, v0)
    M = np.float32([[1, 0, fraction[0]], [0, 1, fraction[1]]])
    alpha = cv2.warpAffine(alpha, M, (w + 1, h + 1))
    texture = cv2.warpAffine(thing.texture, M, (w + 1, h + 1), borderMode=cv2.BORDER_REPLICATE)
    top, left = max(v0, 0), max(u0, 0)
    view = image[top : v0 + h + 1, left : u0 + w + 1]
    if view.size:
        inner = np.s_[top - v0 : top - v0 + view.shape[0], left - u0 : left - u0 + view.shape[1]]
        view += alpha[inner] * (texture[inner] - view)


def _person(k):
    """Opacity of a walking figure of 60 x 150 px: head, trunk, two legs and two arms that swing at 1 Hz."""
    alpha = np.zeros((160, 100), np.float32)
    swing = 0.5 * np.sin(2.0 * np.pi * k / RATE)
    cv2.circle(alpha, (50, 18), 13, 1.0, -1, cv2.LINE_AA)
    cv2.ellipse(alpha, (50, 62), (17, 32), 0, 0, 360, 1.0, -1, cv2.LINE_AA)
    for root, length, width, angle in (
        ((50, 88), 62, 13, swing),
        ((50, 88), 62, 13, -swing),
        ((50, 40), 48, 9, -swing),
        ((50, 40), 48, 9, swing),
    ):
        end = round(root[0] + length * np.sin(angle)), round(root[1] + length * np.cos(angle))
        cv2.line(alpha, root, end, 1.0, width, cv2.LINE_AA)
    return alpha


def _bounce(start, velocity, count, margin, top=None):
    """Returns a straight path (count, 2) [px] that is reflected ``margin`` inside the edges of the image, or at row
    ``top``."""
    path = start + velocity * np.arange(count)[:, None]
    low = np.array([margin, margin if top is None else top])
    span = np.array([WIDTH - 1 - margin, HEIGHT - 1 - margin]) - low
    return low + span - np.abs((path - low) % (2 * span) - span)


def _curve(rng, count, speed, margin):
    """Returns an ellipse (count, 2) [px] that is run through at about ``speed`` [px/image]."""
    radii = rng.uniform(0.5, 1.0, 2) * (0.5 * WIDTH - margin, 0.5 * HEIGHT - margin)
    phase = rng.uniform(0.0, 2.0 * np.pi) + rng.choice([-1, 1]) * speed / radii.mean() * np.arange(count)
    centre = np.array([0.5 * WIDTH, 0.5 * HEIGHT])
    return centre + radii * np.column_stack([np.cos(phase), np.sin(phase)])


def _objects(kind, rng, count):
    """Returns the objects of a clip and their paths in the scene, the one to follow first."""
    if kind == "person":
        thing = _Object(_texture(rng, 100, 160, 210.0, 12.0), _person(0), person=True)
        direction = rng.choice([-1.0, 1.0])
        u = 0.5 * WIDTH + direction * (rng.uniform(2.0, 3.5) * (np.arange(count) - 0.5 * count))
        return [thing], [np.column_stack([u, np.full(count, rng.uniform(200.0, 280.0))])]
    if kind == "ball":
        size, speed = rng.uniform(10.0, 40.0), np.exp(rng.uniform(np.log(2.0), np.log(40.0)))
        angle = rng.uniform(0.0, 2.0 * np.pi)
        start = rng.uniform([60, 60], [WIDTH - 60, HEIGHT - 60])
        path = _bounce(start, speed * np.array([np.cos(angle), np.sin(angle)]), count, 30.0)
        return [disc(rng, size, rng.choice([20.0, 225.0]))], [path]
    if kind == "hidden":
        angle = rng.choice([0.0, np.pi]) + rng.uniform(-0.6, 0.6)
        middle = np.array([0.5 * WIDTH, 0.5 * HEIGHT]) + rng.uniform(-20.0, 20.0, 2)
        step = rng.uniform(2.0, 4.0) * np.array([np.cos(angle), np.sin(angle)])
        path = middle + step * (np.arange(count)[:, None] - 0.5 * count)
        return [disc(rng, rng.uniform(30.0, 50.0), rng.choice([20.0, 225.0]))], [path]
    if kind in FAST_KINDS:
        ball, large = disc(rng, rng.uniform(10.0, 30.0), rng.choice([20.0, 225.0])), rng.uniform(100.0, 140.0)
        speed, angle = np.exp(rng.uniform(np.log(8.0), np.log(40.0))), rng.uniform(0.0, 2.0 * np.pi)
        top = 240.0 if kind == "beside" else 30.0
        start = rng.uniform([60.0, 240.0], [WIDTH - 60.0, HEIGHT - 60.0])
        across = np.array([rng.uniform(100.0, WIDTH - 100.0), rng.uniform(90.0, 130.0)])
        slow = np.array([rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 2.0), 0.0])
        return [ball, disc(rng, large, rng.choice([20.0, 225.0]))], [
            _bounce(start, speed * np.array([np.cos(angle), np.sin(angle)]), count, 30.0, top),
            _bounce(across, slow, count, 75.0),
        ]
    if kind == "crossing":
        sizes = rng.uniform(30.0, 50.0, 2)
        time = np.arange(count) - rng.uniform(0.4, 0.6) * count
        angle = rng.uniform(0.0, 2.0 * np.pi)
        turn = angle + np.pi + rng.uniform(-1.2, 1.2)
        speeds = rng.uniform(1.5, 3.0, 2)
        middle = np.array([0.5 * WIDTH, 0.5 * HEIGHT]) + rng.uniform(-20.0, 20.0, 2)
        paths = [middle + speed * time[:, None] * [np.cos(a), np.sin(a)] for a, speed in zip((angle, turn), speeds)]
        return [disc(rng, size, mean) for size, mean in zip(sizes, rng.permutation([225.0, 25.0]))], paths
    things = [disc(rng, rng.uniform(30.0, 50.0), rng.choice([20.0, 225.0]))]
    speed = rng.uniform(6.0, 14.0) if kind == "blur" else rng.uniform(2.0, 4.0)
    paths = [_curve(rng, count, speed, 110.0 if kind != "rival" else 170.0)]
    if kind == "stop":  # it stands for a second in the middle of the clip
        stands = round(RATE)
        first = round(rng.uniform(0.3, 0.5) * count)
        paths[0] = np.concatenate(
            [paths[0][:first], np.repeat(paths[0][first : first + 1], stands, 0), paths[0][first:]]
        )[:count]
    if kind == "rival":
        things.append(disc(rng, rng.uniform(80.0, 110.0), rng.choice([20.0, 225.0])))
        across = np.array([rng.uniform(0.0, WIDTH), rng.choice([60.0, HEIGHT - 60.0])])
        paths.append(_bounce(across, np.array([rng.choice([-1, 1]) * rng.uniform(2.0, 5.0), 0.0]), count, 58.0))
    return things, paths

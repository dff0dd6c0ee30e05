"""Makes the pictures of the page on tracking several objects.

    python docs/make_several_pictures.py

Two trains and a ball are watched by both cameras, with the arm held above them; the merged silhouette is of the trains
alone. Everything drawn is what the vision has in its Context. The colours are those of the tracks' numbers.
"""

import sys
from pathlib import Path

import cv2
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image
from pydrake.systems.analysis import Simulator

DOCS = Path(__file__).resolve().parent
sys.path[:0] = [str(DOCS.parent / "benchmarks")]

from methods.several_worlds import SEVERAL, WatchingDiagram, watch  # noqa: E402

from drake_tracker import load_scenario  # noqa: E402
from drake_tracker.core.timing import VISION_PERIOD  # noqa: E402
from drake_tracker.tasks.train.setup import resolve  # noqa: E402
from drake_tracker.vision.silhouettes.object_shape import outline_area  # noqa: E402
from drake_tracker.vision.silhouettes.silhouettes import find_silhouettes  # noqa: E402
from drake_tracker.vision.silhouettes.split_silhouettes import divide  # noqa: E402
from drake_tracker.vision.silhouettes.stereo_geometry import projection_jacobian  # noqa: E402
from drake_tracker.vision.silhouettes.validation_gate import ValidationGate  # noqa: E402

IMAGES = DOCS / "images"
SEED = 11
SIDE = "left"
APART, CLOSE = 0.45, 0.15
"""Distances of the second train behind the first [m]: silhouettes apart, and merged."""
WARM_UP, LONGEST = 10.0, 30.0
"""Times [s] from which pictures are taken, and at which the search for one ends."""
LEARNING = (0.3, 1.5, 5.0)
"""Times [s] at which the background is shown."""
SCALE = 3
"""Enlargement of the images."""
PALETTE = 256
"""Number of colours of a picture."""
COLOURS = ("#1f77b4", "#d95f02", "#1b9e77", "#7570b3", "#e7298a", "#666666")
ABOVE_SECONDS = 14.0


def scenario(ahead, ball=True):
    """Returns two trains, with or without a ball."""
    others = f"!Train {{body: striped, ahead: -{ahead}}}{', !Ball {at: 3.0}' if ball else ''}"
    settings = [
        "vision.method=!SilhouetteTracker {}",
        "cameras.render_processes=0",
        "vision.lag_cycles=3",
        f"objects=[{others}]",
    ]
    return load_scenario("train:guided", seed=SEED, overrides=settings)


class Scene:
    """A watched scenario and what its vision has in the Context."""

    def __init__(self, settings):
        self.settings = settings
        self.diagram = WatchingDiagram(settings, SEVERAL)
        self.simulator = Simulator(self.diagram)
        self.vision = self.diagram.GetSubsystemByName("vision_several")
        self.camera = resolve(settings).cameras[SIDE]
        self.cycle = 0

    def advance(self, time):
        """Simulates until a time [s]."""
        self.cycle = round(time / VISION_PERIOD)
        self.simulator.AdvanceTo((self.cycle + 0.9) * VISION_PERIOD)

    def background(self):
        """Returns the `Background` of the newest image, and the image."""
        system, context = self._part(f"foreground_{SIDE}")
        foreground = system.GetOutputPort("foreground").Eval(context)
        return context.get_abstract_state(0).get_value().background, foreground.image

    def tracked(self):
        """Returns (`Foreground`, regions, confirmed tracks) of the newest pair of images that has been tracked."""
        system, context = self._part(f"foreground_{SIDE}")
        foreground = system.GetOutputPort("delayed").Eval(context)
        state = self._part("tracker")[1].get_abstract_state(0).get_value().tracker
        return foreground, state.regions[0], state.confirmed()

    def _part(self, name):
        system = self.vision.GetSubsystemByName(name)
        return system, system.GetMyContextFromRoot(self.simulator.get_context())


def colour(number):
    """Returns the colour of a track, (blue, green, red)."""
    text = COLOURS[(number - 1) % len(COLOURS)]
    return int(text[5:7], 16), int(text[3:5], 16), int(text[1:3], 16)


def enlarged(image, smooth=True):
    """Returns an image in blue, green, red, enlarged."""
    image = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    kind = cv2.INTER_CUBIC if smooth else cv2.INTER_NEAREST
    return cv2.resize(image, None, fx=SCALE, fy=SCALE, interpolation=kind)


def side_by_side(views):
    """Returns images of one height in a row, with white between them."""
    gap = np.full((views[0].shape[0], 8, 3), 255, np.uint8)
    return np.hstack([part for view in views for part in (view, gap)][:-1])


def draw_learning(scene):
    """Returns a row for each time: the image, what is known of the background, the silhouettes."""
    rows = []
    for time in LEARNING:
        scene.advance(time)
        background, image = scene.background()
        known = np.where(background.known[..., None] > 0, background.picture, np.uint8(255))
        rows.append(side_by_side([enlarged(image), enlarged(known), enlarged(background.mask, smooth=False)]))
    gap = np.full((8, rows[0].shape[1], 3), 255, np.uint8)
    stacked = np.vstack([part for row in rows for part in (row, gap)][:-1])
    return cv2.resize(stacked, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)


def draw_regions(scene):
    """Returns the image, its silhouettes, and its regions with the numbers of their tracks."""
    scene.advance(WARM_UP)
    while True:
        foreground, regions, tracks = scene.tracked()
        numbers = [region.track for region in regions if region.track > 0 and not region.shared]
        if len(numbers) == 3 or scene.cycle * VISION_PERIOD > LONGEST:
            break
        scene.advance((scene.cycle + 3) * VISION_PERIOD)
    shown = cv2.convertScaleAbs(enlarged(foreground.image), alpha=0.6)
    for track in tracks:
        draw_box(shown, scene, track, foreground)
    for region in regions:
        draw_centroid(shown, region, foreground)
    return side_by_side([enlarged(foreground.image), enlarged(foreground.mask, smooth=False), shown])


def draw_divided(scene):
    """Returns the image with a merged silhouette, the silhouette, and its two parts with their centroids."""
    scene.advance(WARM_UP)
    while True:
        foreground, regions, tracks = scene.tracked()
        shared = [region for region in regions if region.shared and region.track > 0]
        if len(shared) == 2 or scene.cycle * VISION_PERIOD > LONGEST:
            break
        scene.advance((scene.cycle + 3) * VISION_PERIOD)
    mine = [track for track in tracks if track.number in {region.track for region in shared}]
    image = find_silhouettes(foreground, [window_of(scene.camera, track) for track in mine])
    centres = {region.track: np.array([region.u, region.v]) for region in shared}
    places = {k: centres[track.number] for k, track in enumerate(mine)}
    painted = np.full((*foreground.mask.shape, 3), 255, np.uint8)
    for silhouette in image.expected:
        for k, part in divide(image, silhouette, places):
            shade = 0.45 * 255 + 0.55 * np.array(colour(mine[k].number)[::-1])
            painted[image.box][part.pixels > 0] = shade
    painted = enlarged(painted, smooth=False)
    for track in mine:
        draw_box(painted, scene, track, foreground)
    for region in shared:
        draw_centroid(painted, region, foreground)
    return side_by_side([enlarged(foreground.image), enlarged(foreground.mask, smooth=False), painted])


def window_of(camera, track):
    """Returns the window of a track in the image of a camera."""
    J = projection_jacobian(camera, track.position)
    u, v = camera.project(track.position)[0]
    edges = J @ track.shape.edges
    depth = float(np.linalg.norm(track.position - camera.X_WC[:3, 3]))
    return ValidationGate(track.number, u, v, 1.0, edges, track.shape.fill * outline_area(edges), depth, J)


def draw_box(image, scene, track, foreground):
    """Draws the outline of the box that has been learned of an object."""
    signs = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1)
    corners = scene.camera.project(track.position + (track.shape.edges @ signs).T) - foreground.image_offset
    hull = cv2.convexHull((SCALE * (corners + 0.5)).astype(np.float32))
    cv2.polylines(image, [np.rint(hull).astype(np.int32)], True, colour(track.number), 2, cv2.LINE_AA)


def draw_centroid(image, region, foreground):
    """Draws the centroid of a region and the number of its track."""
    place = SCALE * (np.array([region.u, region.v]) - foreground.image_offset + 0.5)
    u, v = np.rint(place).astype(int)
    name, ink = (str(region.track), colour(region.track)) if region.track > 0 else ("new", (128, 128, 128))
    cv2.circle(image, (u, v), 5, (255, 255, 255), -1, cv2.LINE_AA)
    cv2.circle(image, (u, v), 4, ink, -1, cv2.LINE_AA)
    for width, shade in ((7, (255, 255, 255)), (3, ink)):
        cv2.putText(image, name, (u + 12, v - 16), cv2.FONT_HERSHEY_SIMPLEX, 1.2, shade, width, cv2.LINE_AA)


def draw_above(path):
    """Draws measured points of the tracks and the truth, as seen from above."""
    record = watch(scenario(CLOSE), ABOVE_SECONDS, SEVERAL)["several"]
    figure, axes = plt.subplots(figsize=(8.0, 4.6), layout="constrained")
    for thing in range(record.p_WO.shape[1]):
        axes.plot(*record.p_WO[:, thing, :2].T, color="0.75", linewidth=4, label="truth" if thing == 0 else None)
    for number in sorted({int(each) for each in record.numbers.ravel()} - {0}):
        images, slots = np.nonzero(record.numbers == number)
        x, y = record.points[images, slots, :2].T
        axes.plot(x, y, ".", markersize=2, color=COLOURS[(number - 1) % len(COLOURS)], label=f"track {number}")
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), markerscale=5, frameon=False)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main():
    apart = Scene(scenario(APART))
    pictures = {"several_background": draw_learning(apart), "several_regions": draw_regions(apart)}
    pictures["several_divided"] = draw_divided(Scene(scenario(CLOSE, ball=False)))
    for name, picture in pictures.items():
        path = IMAGES / f"{name}.png"
        image = Image.fromarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))
        image = image.quantize(PALETTE, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE)
        image.save(path, optimize=True)
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")
    draw_above(IMAGES / "several_above.png")


if __name__ == "__main__":
    main()

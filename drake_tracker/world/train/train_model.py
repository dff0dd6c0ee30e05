"""The models of the trains, in another length and colour."""

import xml.etree.ElementTree as ElementTree

import cv2
import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_tracker.arm.plant import models_parser
from drake_tracker.core.colour import rgb
from drake_tracker.core.models_path import models_path
from drake_tracker.world.painted_mesh import CELL, paint_visual, palette_paint

_URL = "package://drake_tracker_models/train/train_{}.sdf"
PAINTED_CELLS = {"plain": (0, 1), "striped": (2,), "round": (3,), "dark": (10,), "cube": (3,)}
"""{body: numbers of the colours in palette.png that ``train.colour`` replaces}: yellow and cream, white, red, coal."""


def train_colour(body: str) -> np.ndarray:
    """Returns red, green and blue of the main colour of a train model, from 0 to 1, shape (3,).

    Args:
        body: which of the train models, one of `TRAIN_BODIES`.
    """
    palette = cv2.imread(str(models_path() / "train" / "palette.png"))
    return palette[0, CELL * PAINTED_CELLS[body][0], ::-1] / 255.0


def add_train(
    plant: MultibodyPlant,
    *,
    body: str = "plain",
    scale: float = 1.0,
    colour: str = "",
    name: str = "train",
    scene_graph: SceneGraph | None = None,
) -> ModelInstanceIndex:
    """Adds a train, one free body.

    Args:
        plant: not yet finalized.
        body: which of the train models, one of `TRAIN_BODIES`.
        scale: length of the train relative to its model. Width and height stay, so that it fits track and jaws; the
            mass grows with the length. A cube grows in all directions, on the same base.
        colour: main colour as "#rrggbb"; empty: the colour of the model.
        name: of the model instance.
        scene_graph: with which the plant is registered; needed to change the colour.
    """
    parser = models_parser(plant)
    if scale == 1.0 and name == "train":
        (train,) = parser.AddModelsFromUrl(_URL.format(body))
    else:
        (train,) = parser.AddModelsFromString(train_text(body, scale=scale, name=name), "sdf")
    if colour:
        assert scene_graph is not None
        paint = palette_paint(PAINTED_CELLS[body], rgb(colour))
        link = plant.GetBodyByName("train", train)
        paint_visual(plant, scene_graph, body=link, name=f"{name}::look", paint=paint)
    return train


def train_text(body: str, *, scale: float, name: str) -> str:
    """Returns the SDF text of a train of another length.

    Args:
        body: which of the train models.
        scale: length of the train relative to its model.
        name: of the model.
    """
    ElementTree.register_namespace("drake", "drake.mit.edu")
    root = ElementTree.parse(models_path() / "train" / f"train_{body}.sdf").getroot()
    (model,) = root.iter("model")
    model.set("name", name)
    stretch = [scale] * 3 if body == "cube" else [scale, 1.0, 1.0]
    for size in model.iter("size"):
        box = _numbers(size) * stretch
        size.text = _text(box)
    for pose in model.iter("pose") if body != "cube" else ():
        pose.text = _text(_numbers(pose) * [scale, *[1.0] * 5])
    for mesh in model.iter("mesh"):
        ElementTree.SubElement(mesh, "scale").text = _text(stretch)
    (mass,) = model.iter("mass")
    kilograms = float(np.prod(stretch)) * float(mass.text or "")
    mass.text = repr(kilograms)
    x, y, z = box**2
    for axis, square in (("ixx", y + z), ("iyy", x + z), ("izz", x + y)):
        (moment,) = model.iter(axis)
        moment.text = repr(float(kilograms * square / 12.0))
    return ElementTree.tostring(root, encoding="unicode")


def _numbers(element: ElementTree.Element) -> np.ndarray:
    return np.array((element.text or "").split(), dtype=float)


def _text(numbers: np.ndarray | list[float]) -> str:
    return " ".join(repr(float(number)) for number in numbers)

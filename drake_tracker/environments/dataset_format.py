"""LeRobot's data set format v3.0: the features of a frame, their statistics, and the tables."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces

from drake_tracker.campaign.table import require_parquet
from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.footage.decoding import decoding

CHUNK = 1000
"""Greatest number of files in a folder."""
FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}"
DATA, EPISODES, VIDEO = f"data/{FILE}.parquet", f"meta/episodes/{FILE}.parquet", f"videos/{{video_key}}/{FILE}.mp4"
"""Paths of the files of an episode. Each episode has its own files."""
NEED = ("a data set", "dataset")
"""Needs pyarrow, and the extra that installs it."""
INDICES = ("frame_index", "episode_index", "index", "task_index")
COLUMNS = {
    **dict.fromkeys(("busy", "next.done", "next.success"), "bool"),
    **dict.fromkeys(("timestamp", "next.reward"), "float32"),
    **dict.fromkeys(INDICES, "int64"),
}
"""{feature of one number: its type}. ``busy``: the policy still computed, and the action is an earlier one."""
QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
"""{statistic: quantile}, those of LeRobot."""
_STATE = ("arm_state", "tool", "jaws")
_PLACES = dict.fromkeys(_STATE, "observation.state") | {"time": "observation.time", "truth": "privileged.truth"}
"""{observation: its feature}. LeRobot's policies take only features that begin with "observation" for observations."""


def vectors_of(space: spaces.Dict) -> dict[str, list[str]]:
    """Returns {feature: observations that it joins}, without images. Measurements are ``environment_state``."""
    found: dict[str, list[str]] = {}
    for name in dict.fromkeys(name for name in (*_PLACES, *space) if name in space.spaces):
        age = f"observation.{name}" if name.endswith("_age") else "observation.environment_state"
        if space[name].dtype != np.uint8:
            found.setdefault(_PLACES.get(name, age), []).append(name)
    return found


def element_names(name: str, box: spaces.Space[Any], fields: Sequence[str]) -> list[str]:
    """Returns the names of the elements of an observation: "point.x.1" is the x of its second row.

    Args:
        name: of the observation.
        box: its space.
        fields: of a row. If there are more or fewer elements than fields, the elements are numbered.
    """
    *rows, size = box.shape or (1,)
    elements = [f"{name}.{field}" for field in (fields if len(fields) == size else range(size))]
    return [f"{element}.{row}" for row in range(rows[0]) for element in elements] if rows else elements


def statistics_of(values: np.ndarray) -> dict[str, np.ndarray]:
    """Returns {statistic: value of each element} of a feature over its frames, shape (frames,) or (frames, size)."""
    values = np.asarray(values, dtype=float).reshape(len(values), -1)
    found = {name: getattr(np, name)(values, axis=0) for name in ("min", "max", "mean", "std")}
    quantiles = np.quantile(values, list(QUANTILES.values()), axis=0)
    return {**found, **dict(zip(QUANTILES, quantiles)), "count": np.array([len(values)])}


def image_statistics(samples: Sequence[np.ndarray]) -> dict[str, np.ndarray]:
    """Returns the statistics, shape (3, 1, 1), of the channels of images, uint8 (height, width, 3), as 0 to 1."""
    found = statistics_of(np.concatenate([sample.reshape(-1, 3) for sample in samples]) / 255.0)
    return {**{name: value.reshape(-1, 1, 1) for name, value in found.items()}, "count": np.array([len(samples)])}


def joined(parts: Sequence[Mapping[str, Any]]) -> dict[str, np.ndarray]:
    """Returns the statistics of several episodes together. As in LeRobot, a quantile is the mean of theirs."""
    every = {name: np.array([part[name] for part in parts]) for name in parts[0]}
    counts = every.pop("count").ravel()
    found = {name: np.average(values, axis=0, weights=counts) for name, values in every.items()}
    spread = every["std"] ** 2 + (every["mean"] - found["mean"]) ** 2
    found |= {"std": np.sqrt(np.average(spread, axis=0, weights=counts)), "count": np.array([counts.sum()])}
    return {**found, "min": every["min"].min(axis=0), "max": every["max"].max(axis=0)}


def write_table(columns: Mapping[str, Any], path: Path, metadata: Mapping[str, str] | None = None) -> None:
    """Writes {column: list, or array of shape (rows,) or (rows, size)} as Parquet, which replaces a file."""
    pyarrow, parquet = require_parquet(*NEED)
    arrays = {}
    for name, values in columns.items():
        vectors = isinstance(values, np.ndarray) and values.ndim == 2
        flat = pyarrow.array(values.ravel() if vectors else values)
        arrays[name] = pyarrow.FixedSizeListArray.from_arrays(flat, values.shape[1]) if vectors else flat
    with replacing(path) as beside:
        parquet.write_table(pyarrow.table(arrays).replace_schema_metadata(metadata), beside)


def write_task(sentence: str, path: Path) -> None:
    """Writes the table of tasks, with one task. LeRobot reads it with pandas, with the sentences as the index."""
    kinds = {"task_index": ("int64", "int64"), "task": ("unicode", "object")}
    keys = ("name", "field_name", "pandas_type", "numpy_type", "metadata")
    columns = [dict(zip(keys, (name, name, *kind, None))) for name, kind in kinds.items()]
    pandas = {"index_columns": ["task"], "column_indexes": [], "columns": columns}
    write_table({"task_index": [0], "task": [sentence]}, path, {"pandas": json.dumps(pandas)})


def read_rows(folder: Path) -> list[dict[str, Any]]:
    """Returns the rows of the tables in a folder. Raises DrakeTrackerError when one of them is damaged."""
    _, parquet = require_parquet(*NEED)
    rows: list[dict[str, Any]] = []
    for path in sorted(folder.glob("*/file-*.parquet")):
        with decoding(path, "damaged, choose another folder"):
            rows += parquet.ParquetFile(path).read().to_pylist()
    return rows

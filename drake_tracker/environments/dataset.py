"""A data set for LeRobot: a folder to which episodes of a policy are added, and which can be continued."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from drake_tracker import __version__
from drake_tracker.campaign.directory import check_directory
from drake_tracker.core.errors import DrakeTrackerError, FirstError
from drake_tracker.core.files.atomic_file import replacing, unwritable, write_text
from drake_tracker.core.processes.signals import held
from drake_tracker.environments import dataset_format as lerobot
from drake_tracker.environments.environment import Observation, TrackerEnvironment
from drake_tracker.environments.policy import Policy, run_episode
from drake_tracker.run.video_file import VideoFile
from drake_tracker.tasks.loader import save_scenario
from drake_tracker.tasks.results import made_by

PLAN, SETTINGS, TASKS = "meta/drake_tracker.json", "meta/drake_tracker.yaml", "meta/tasks.parquet"
"""Files with the command that made the data set and with all settings of the scenario, which LeRobot ignores, and with
the sentence that LeRobot gives to policies."""
SENTENCES = {"train": "Lift the moving train.", "ball": "Catch the rolling ball.", "conveyor": "Put parts into trays."}
POSE = ("x", "y", "z", "yaw")
_SAMPLED = 8
"""Distance between the pixels of which statistics are computed [px]; chosen."""


class DataSet:
    """A folder with a data set. An episode counts as soon as its row of metadata is there, which is written last.

    Args:
        out: the folder: new, empty, or with the same plan.
        env: the environment.
        plan: {name: value} that must not change when the data set is continued.
        episodes: number of episodes that are planned, which may grow.

    Attributes:
        rows: the metadata of each finished episode.

    Raises DrakeTrackerError when the folder has other content or cannot be written.
    """

    def __init__(self, out: Path, env: TrackerEnvironment, plan: Mapping[str, Any], episodes: int) -> None:
        self._out, self._env, self._space = out, env, env.action_space
        self._rate = 1 / Fraction(env.task.servo_period).limit_denominator(1000)
        self._sentence = SENTENCES.get(env.task.name, env.task.name)
        self._fps = int(self._rate) if self._rate.denominator == 1 else float(self._rate)
        boxes = {name: box.shape or () for name, box in env.observation_space.items() if box.dtype == np.uint8}
        sizes = {name: (height // 2 * 2, width // 2 * 2) for name, (_, height, width, _) in boxes.items()}  # for H.264
        self._cameras = {f"observation.images.{name}": (name, size) for name, size in sizes.items()}
        settings = hashlib.sha256(repr(env.scenario).encode()).hexdigest()
        wanted = {**plan, "drake_tracker": __version__, "settings_sha256": settings, "episodes": episodes}
        found = check_directory(out, wanted, PLAN, "data set", "episodes")
        for left in out.rglob(".file-*"):  # by a killed process
            left.unlink()
        self.rows = lerobot.read_rows(out / "meta/episodes")
        if [row.get("episode_index") for row in self.rows] != list(range(len(self.rows))):
            raise DrakeTrackerError(f"{out}/meta/episodes: damaged, an episode is missing; choose another directory")
        try:
            totals = self._totals()
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
            raise DrakeTrackerError(f"{out}/meta/episodes: damaged, not of this package; choose another one") from None
        if not found:
            save_scenario(env.scenario, self._path(SETTINGS))
            lerobot.write_task(self._sentence, self._path(TASKS))
        self._write_json(PLAN, {**made_by(), "privileged": "truth" in env.observation_space.spaces, **found, **wanted})
        self._write(totals)

    @property
    def frames(self) -> int:
        """Number of frames of the finished episodes."""
        return self.rows[-1]["dataset_to_index"] if self.rows else 0

    def record(self, policy: Policy, seed: int) -> None:
        """Runs an episode with a seed, and adds it whatever its verdict."""
        episode, vectors = len(self.rows), lerobot.vectors_of(self._env.observation_space)
        place = dict(zip(("chunk_index", "file_index"), divmod(episode, lerobot.CHUNK)))
        frames: dict[str, list[Any]] = {}
        samples: dict[str, list[np.ndarray]] = {key: [] for key in self._cameras}
        trouble = FirstError()  # of a video, not of the policy
        with ExitStack() as files:  # at its end the videos get their names; an error removes them
            videos: dict[str, VideoFile] = {}
            for key, (_, (height, width)) in self._cameras.items():
                beside = files.enter_context(replacing(self._path(lerobot.VIDEO, video_key=key, **place)))
                videos[key] = VideoFile(beside, self._rate, (width, height), threads=1)
                files.callback(videos[key].close)

            def watch(seen: Observation, action: np.ndarray, info: Mapping[str, Any]) -> None:
                frame = {key: np.concatenate([seen[name].ravel() for name in names]) for key, names in vectors.items()}
                frame |= {"action": np.clip(action, self._space.low, self._space.high), "busy": info["busy"]}
                frame |= {f"next.{key}": info[key] for key in ("reward", "done", "success")}
                for key, value in frame.items():
                    frames.setdefault(key, []).append(value)
                for key, (name, (height, width)) in self._cameras.items():
                    newest = max(int(np.sum(seen[f"{name}_age"] >= 0.0)) - 1, 0)
                    image = seen[name][newest, :height, :width]
                    samples[key].append(image[::_SAMPLED, ::_SAMPLED])
                    with trouble.kept():
                        videos[key].write(np.ascontiguousarray(image[:, :, ::-1]))

            result = run_episode(self._env, policy, seed, watch)
            trouble.raise_it()
        columns, length = self._columns(frames, episode), result["steps"]
        row = dict(episode_index=episode, tasks=[self._sentence], length=length, seed=seed)
        row |= {key: result[key] for key in ("success", "reason", "reproducible")}
        row |= dict(dataset_from_index=self.frames, dataset_to_index=self.frames + length)
        for folder in ("data", "meta/episodes", *(f"videos/{key}" for key in videos)):
            row |= {f"{folder}/{key}": number for key, number in place.items()}
        for key in videos:
            row |= {f"videos/{key}/from_timestamp": 0.0, f"videos/{key}/to_timestamp": float(length / self._rate)}
        statistics = {name: lerobot.statistics_of(column) for name, column in columns.items()}
        statistics |= {key: lerobot.image_statistics(images) for key, images in samples.items()}
        for name, values in statistics.items():
            row |= {f"stats/{name}/{key}": value.tolist() for key, value in values.items()}
        with held():  # Ctrl-C does not divide the files of an episode
            lerobot.write_table(columns, self._path(lerobot.DATA, **place))
            lerobot.write_table({name: [value] for name, value in row.items()}, self._path(lerobot.EPISODES, **place))
            self.rows.append(row)
            self._write(self._totals())

    def _columns(self, frames: Mapping[str, Sequence[Any]], episode: int) -> dict[str, np.ndarray]:
        """Returns {feature: array (frames,) or (frames, size)} of an episode, with the types of the features."""
        numbers, features, found = np.arange(len(frames["action"])), self._features(), {}
        indices = (numbers, 0 * numbers + episode, self.frames + numbers, 0 * numbers)
        every = {**frames, "timestamp": numbers / float(self._rate), **dict(zip(lerobot.INDICES, indices))}
        for name, values in every.items():
            array = np.array(values, dtype=features[name]["dtype"]).reshape(len(numbers), -1)
            found[name] = array[:, 0] if array.shape[1] == 1 else array
        return found

    def _features(self) -> dict[str, Any]:
        """Returns {feature: its description} as LeRobot has it."""
        space, task = self._env.observation_space, self._env.task
        fields = {name: content for name, (_, content) in task.signals().items()}
        fields |= {"tool": POSE, "truth": fields.get(task.truth_signal, ())}
        names = {"action": [*POSE, "jaws"][: self._space.low.size]}
        for key, parts in lerobot.vectors_of(space).items():
            names[key] = [n for name in parts for n in lerobot.element_names(name, space[name], fields.get(name, ()))]
        found: dict[str, Any] = {key: dict(dtype="float32", shape=[len(n)], names=n) for key, n in names.items()}
        for key, (_, (height, width)) in self._cameras.items():
            size, axes = [height, width, 3], ["height", "width", "channels"]
            info = dict(zip(map("video.{}".format, axes), size)) | {"video.fps": self._fps, "video.codec": "h264"}
            info |= {"video.pix_fmt": "yuv420p", "video.is_depth_map": False, "has_audio": False}
            found[key] = dict(dtype="video", shape=size, names=axes, info=info)
        return found | {key: dict(dtype=dtype, shape=[1], names=None) for key, dtype in lerobot.COLUMNS.items()}

    def _totals(self) -> dict[str, Any]:
        """Returns {file: its content} of the files about all episodes."""
        count, features, statistics = len(self.rows), self._features(), {}
        for name in features if self.rows else ():
            start = f"stats/{name}/"
            parts = [{key[len(start) :]: row[key] for key in row if key.startswith(start)} for row in self.rows]
            statistics[name] = {key: value.tolist() for key, value in lerobot.joined(parts).items()}
        arm = type(self._env.scenario.arm).__name__
        info: dict[str, Any] = dict(codebase_version="v3.0", robot_type=arm, fps=self._fps)
        info |= dict(total_episodes=count, total_frames=self.frames, total_tasks=1, chunks_size=lerobot.CHUNK)
        info |= dict(data_files_size_in_mb=100, video_files_size_in_mb=200, splits={"train": f"0:{count}"})
        info |= dict(data_path=lerobot.DATA, video_path=lerobot.VIDEO if self._cameras else None, features=features)
        return {"meta/stats.json": statistics, "meta/info.json": info}

    def _write(self, contents: Mapping[str, Any]) -> None:
        for name, content in contents.items():
            self._write_json(name, content)

    def _write_json(self, name: str, value: Any) -> None:
        write_text(self._path(name), json.dumps(value, indent=2) + "\n")

    def _path(self, pattern: str, **values: Any) -> Path:
        """Returns the path of a file, whose folder it makes."""
        path = self._out / pattern.format(**values)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise unwritable(path, error) from None
        return path

"""Cases of `fuzz.py` that come in files and on the command line: scenarios, runs, campaigns and calibrations."""

import json
import os
import shutil
import sqlite3
import struct
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import yaml
from autopsy_run import AutopsyRun
from campaign_trials import here, quick
from films import CAMERAS, film, write_calibration, write_images, write_video
from fuzz_parts.guard import command, process, watched
from fuzz_parts.mutations import SCALARS, mutate, mutate_json, mutate_log, mutate_yaml
from mcap.writer import Writer
from urdf_arms import MOTORS, urdf

import drake_tracker.campaign.run as campaign_run
from drake_tracker import cli
from drake_tracker.arm.arm_check import check_arm
from drake_tracker.arm.description import PUMA560
from drake_tracker.cameras.files.calibration_file import load_calibration, load_pose
from drake_tracker.cameras.files.camera_files import KALIBR, OPENCV, ROS, load_cameras, save_foreign
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import LOG_FILE, STREAM_FILE, LogStream, save_log
from drake_tracker.core.models_path import models_path
from drake_tracker.core.processes.loopback_server import LoopbackServer
from drake_tracker.measured.measured_error_file import load_error
from drake_tracker.scenarios.reader import describe_settings
from drake_tracker.tasks import list_scenarios, load_scenario, save_scenario, scenario_file
from drake_tracker.tasks.results import package_versions, tidy
from drake_tracker.world.train.tracks import make_track

BASE = Path("base")
"""Folder of the good files, in the scratch folder of the process."""
RUN_FILES = ["summary.json", "scenario.yaml", LOG_FILE, STREAM_FILE, "report.html", "cameras.mp4", "tracking.png"]
NAMES = [b"\xff.png", b"\x1b[31m.png", b"<b>.html", b"a" * 200, b"report.html.png", b" ", b"-x", b"log.npy"]
FAULTS = "[!LinkDelay {delay: 1.5, at: 4, for: 6}, !TrainStopped {at: 8}, !StickingJoint {joint: 1, friction: 30}]"
CAMPAIGN = ("campaign", "train", "--trials", "2", "--vary", "track.speed=0.1,0.3", "--vision", "measured")
DATASET = ("dataset", "train:guided", "--no-images", "--policy", "guided", "--episodes", "1", "--set", "duration=1")


def prepare(scratch):
    """Makes the good files, and replaces what would wait for a person or simulate for minutes."""
    global BASE
    BASE = scratch / "base"
    run = BASE / "run"
    run.mkdir(parents=True)
    made_up = AutopsyRun(beside=0.04)
    log = made_up.log()
    save_scenario(made_up.scenario(), run / "scenario.yaml")
    save_log(log, run / LOG_FILE)
    summary = {"scenario": "made-up", "seed": 1, "success": False, "failure_reason": "attempt 1 missed", "attempts": 1}
    summary |= {"prediction_rms_m": 0.0123, "lag_s": {"min": 0.25, "max": 0.25}, "package_versions": package_versions()}
    (run / "summary.json").write_text(json.dumps(tidy(summary)))
    for name in ("recording.html", "cameras.mp4", "tracking.png", "motion.png"):
        (run / name).write_bytes(bytes(range(256)))
    times = np.arange(12) / 30.0
    write_images(BASE / "images", film("left", times))
    write_video(BASE / "left.mkv", film("left", times), times)
    coded = [turned_jpeg(image, 1 + number % 8) for number, image in enumerate(film("left", times))]
    (BASE / "photographs").mkdir()
    for number, data in enumerate(coded):
        (BASE / "photographs" / f"{number}.jpg").write_bytes(data)
    (BASE / "left.mjpeg").write_bytes(b"".join(coded))
    write_bags(BASE, coded)
    (BASE / "arm.urdf").write_text(urdf(drives=MOTORS))
    shutil.copy(models_path() / "puma560" / "puma560.sdf", BASE)
    write_calibration(BASE / "cameras.yaml")
    LoopbackServer.serve_forever = lambda server, *_: None
    campaign_run.make_runner = lambda *_: lambda work, jobs: here(quick, jobs)
    cli.main([*CAMPAIGN, "--out", str(BASE / "campaign")])
    cli.main([*DATASET, "-o", str(BASE / "dataset")])


def turned_jpeg(image, orientation):
    """A JPEG file with an EXIF orientation."""
    data = cv2.imencode(".jpg", image)[1].tobytes()
    entry = struct.pack("<HHIHH", 0x112, 3, 1, orientation, 0)
    body = b"Exif\0\0II*\0" + struct.pack("<IH", 8, 1) + entry + bytes(4)
    return data[:2] + b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body + data[2:]


def write_bags(folder, coded):
    """Writes bag.mcap and bag.db3 with compressed images, 30 a second."""
    kind, rows = "sensor_msgs/msg/CompressedImage", []
    for number, data in enumerate(coded):
        stamp = number * 33_000_000
        head = struct.pack("<4sIII", b"\0\1\0\0", 1, stamp, 2) + b"a\0\0\0"
        rows.append(
            (10**9 + stamp, head + struct.pack("<I", 5) + b"jpeg\0\0\0\0" + struct.pack("<I", len(data)) + data)
        )
    with open(folder / "bag.mcap", "wb") as stream:
        writer = Writer(stream, chunk_size=20_000)
        writer.start()
        schema = writer.register_schema(name=kind, encoding="ros2msg", data=b"")
        channel = writer.register_channel(topic="/left", message_encoding="cdr", schema_id=schema)
        for stamp, data in rows:
            writer.add_message(channel_id=channel, log_time=stamp, publish_time=stamp, data=data)
        writer.finish()
    with sqlite3.connect(folder / "bag.db3") as base:
        base.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT)")
        base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
        base.execute("INSERT INTO topics VALUES (1, '/left', ?)", (kind,))
        base.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (1, ?, ?)", rows)
    base.close()


@cache
def scenario_texts():
    """Texts of good scenario files: each scenario in full, and the files of the package with their inheritance."""
    texts = [scenario_file(f"{name}.yaml").read_text() for name in ("train", "ball")]
    faulty = load_scenario("train:learned", overrides=[f"faults={FAULTS}"])
    for scenario in (faulty, *(load_scenario(name) for name, _ in list_scenarios())):
        path = BASE / "mine.yaml"
        save_scenario(scenario, path)
        texts.append(path.read_text())
    return texts


@cache
def settings(name):
    """Keys and values of the settings of a scenario."""
    return [row[:2] for row in describe_settings(load_scenario(name))]


@cache
def good_log():
    return AutopsyRun(beside=0.04).log()


def write_scenario(generator, folder):
    """Writes a damaged scenario file into the working directory; returns its name for the command line."""
    text = mutate_yaml(generator, generator.choice(scenario_texts()), generator.randint(1, 3))
    (folder / "here" / "mine.yaml").write_bytes(text.encode("utf-8", "surrogateescape"))
    return "mine.yaml" + generator.choice([*[""] * 8, ":train", ":paper", ":x", ":", "::"])


def override(generator):
    """Returns a change of a setting for the command line, valid in some cases."""
    key, value = generator.choice(settings(generator.choice(["train", "ball"])))
    if generator.random() < 0.2:
        key = mutate(generator, key.encode(), 1).decode("utf-8", "replace").replace("\0", "")
    return f"{key}={generator.choice([mutate_yaml(generator, value, 1), value, generator.choice(SCALARS)])}".replace(
        "\0", ""
    )


def scenario(generator, folder):
    """`list` of a scenario file."""
    return command(folder, folder / "nothing", "list", write_scenario(generator, folder))


def setting(generator, folder):
    """A campaign of which a scenario file or settings are damaged; its trials are not simulated."""
    name = write_scenario(generator, folder) if generator.random() < 0.5 else generator.choice(["train", "ball"])
    changes = [part for _ in range(generator.randint(1, 2)) for part in ("--set", override(generator))]
    return command(folder, folder / "here" / "out", "campaign", name, "--trials", "1", "--out", "out", *changes)


def short_run(generator, folder):
    """A run of a moment, where the damaged scenario is valid."""
    arguments = ["run", write_scenario(generator, folder), "--set", "vision=!Measured {}", "--no-record"]
    if generator.random() < 0.5:
        arguments += ["--set", override(generator)]
    return command(folder, folder / "here" / "out", *arguments, "--duration", "0.3", "--out", "out")


def write_run(generator, folder):
    """Writes a damaged run directory into the working directory; returns its path."""
    run = folder / "here" / "run"
    shutil.copytree(BASE / "run", run)
    for _ in range(generator.randint(1, 3)):
        name = generator.choice(RUN_FILES)
        path, kind = run / name, generator.randrange(10)
        if kind < 6:
            damage(generator, path)
        elif kind == 6:
            remove(path)
            generator.choice([os.mkfifo, os.mkdir])(path)
        elif kind == 7:
            remove(path)
            path.symlink_to(generator.choice(["../../outside/precious", "/dev/zero", "nowhere", name, "..", "/etc"]))
        elif kind == 8:
            remove(path)
        else:
            Path(os.fsdecode(os.path.join(os.fsencode(run), generator.choice(NAMES)))).write_bytes(b"x")
    return run


def damage(generator, path):
    """Damages the content of a file of a run."""
    if not path.is_file() or path.is_symlink():
        if path.name == STREAM_FILE and not os.path.lexists(path):
            remove(path.parent / LOG_FILE)
            log = good_log()
            stream = LogStream(path, {name: signal.names for name, signal in log.items()})
            stream.append({name: (signal.times, signal.data) for name, signal in log.items()})
            stream.close()
        else:
            return
    if path.name == LOG_FILE and generator.random() < 0.7:
        with np.errstate(all="ignore"):
            save_log(mutate_log(generator, good_log()), path)
    elif path.suffix == ".yaml":
        text = mutate_yaml(generator, path.read_text(errors="replace"), 2)
        path.write_bytes(text.encode("utf-8", "surrogateescape"))
    elif path.suffix == ".json":
        try:
            path.write_bytes(mutate_json(generator, path.read_bytes(), 2))
        except ValueError:  # it was damaged before
            path.write_bytes(mutate(generator, path.read_bytes(), 2))
    else:
        path.write_bytes(mutate(generator, path.read_bytes(), 3))


def remove(path):
    """Removes a file or a folder."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def view(generator, folder):
    """`view` of a run directory."""
    run = write_run(generator, folder)
    return command(folder, run, "view", "run", "--no-browser", "--port", "0")


def replay(generator, folder):
    """`replay` of a run directory."""
    write_run(generator, folder)
    arguments = ["replay", "run", "--out", "out"]
    if generator.random() < 0.7:
        arguments += ["--from", generator.choice(["points", "centroids", "images"])]
    if generator.random() < 0.3:
        arguments += ["--set", override(generator)]
    return command(folder, folder / "here" / "out", *arguments)


def campaign(generator, folder):
    """The directory of a campaign, which the same command continues."""
    out = folder / "here" / "out"
    shutil.copytree(BASE / "campaign", out)
    for _ in range(generator.randint(1, 2)):
        path = out / generator.choice(["campaign.json", "trials.jsonl", "trials.jsonl", "trials.csv"])
        kind = generator.randrange(8)
        if kind == 0:
            remove(path)
            generator.choice([os.mkfifo, os.mkdir])(path)
        elif kind == 1:
            remove(path)
            path.symlink_to(generator.choice(["../../outside/precious", "/dev/zero", "nowhere", path.name]))
        elif path.is_file() and not path.is_symlink():
            damage_record(generator, path)
    return command(folder, out, *CAMPAIGN, "--out", "out")


def dataset(generator, folder):
    """The directory of a data set, which the same command would continue."""
    out = folder / "here" / "out"
    shutil.copytree(BASE / "dataset", out)
    for _ in range(generator.randint(1, 2)):
        damage(generator, generator.choice(sorted(path for path in out.rglob("*") if path.is_file())))
    return command(folder, out, *DATASET, "-o", "out")


def damage_record(generator, path):
    """Damages a plan, or some lines of a record."""
    if path.suffix == ".csv":
        path.write_bytes(mutate(generator, path.read_bytes(), 2))
        return
    lines = path.read_bytes().splitlines() if path.suffix == ".jsonl" else [path.read_bytes()]
    for k in range(len(lines)):
        if generator.random() < 0.5:
            try:
                lines[k] = mutate_json(generator, lines[k], 1)
            except ValueError:
                lines[k] = mutate(generator, lines[k], 1)
    path.write_bytes(b"\n".join(lines) + b"\n" * generator.randrange(2))


def data_file(generator, folder):
    """Files of calibrations, also of other tools, measured errors, poses, tracks and points for `predict`."""
    pose = yaml.safe_dump({"X_WP": np.eye(4).tolist()})
    texts = [scenario_file(name).read_text() for name in ("train_cameras.yaml", "train_vision.yaml")]
    path = folder / "here" / "file"
    loads = [(load_calibration, path), (load_error, path), (load_pose, path, "X_WP")]
    for text in (*texts, pose):
        path.write_bytes(mutate_yaml(generator, text, generator.randint(1, 3)).encode("utf-8", "surrogateescape"))
        for load, *arguments in loads:
            with watched(folder, folder / "nothing"), suppress(DrakeTrackerError):
                load(*arguments)
    header, angles = generator.choice([["x", "y"], ["x", "y", "z"], ["x", "y", "z", "bank"]]), np.arange(0.0, 6.2, 0.3)
    columns = [0.5 + 0.2 * np.cos(angles), 0.2 * np.sin(angles), 0.04 + 0.02 * np.sin(2.0 * angles), 5.0 + 0.0 * angles]
    rows = [",".join(map(str, row[: len(header)])) for row in np.column_stack(columns)]
    text = "\n".join([",".join(header), *rows])
    path.write_bytes(mutate_yaml(generator, text, 2).encode("utf-8", "surrogateescape"))
    with watched(folder, folder / "nothing"), suppress(DrakeTrackerError):
        make_track("csv", csv=str(path))
    origin = generator.choice([0.0, -50.0, 1.7e9])
    rows = [f"{origin + angle},{row}" for angle, row in zip(angles, rows)]
    text = "\n".join([",".join([generator.choice(["stamp", "time", "t"]), *header]), *rows])
    path.write_bytes(mutate_yaml(generator, text, generator.randrange(3)).encode("utf-8", "surrogateescape"))
    command(folder, folder / "here" / "out.csv", "predict", "file", "--out", "out.csv")
    foreign_calibration(generator, folder)


def foreign_calibration(generator, folder):
    """Calibrations of OpenCV, ROS and Kalibr."""
    form = generator.choice([OPENCV, ROS, KALIBR])
    paths = save_foreign(folder / "here" / f"cameras.{generator.choice(['yaml', 'yml', 'xml'])}", CAMERAS, form)
    for path in generator.sample(paths, generator.randint(1, len(paths))):
        whole = path.read_text()
        if form == ROS:
            whole += "binning_x: 2\nbinning_y: 1\nroi: {x_offset: 10, y_offset: 20, width: 100, height: 80}\n"
        text = mutate_yaml(generator, whole, generator.randint(1, 3))
        path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with watched(folder, folder / "nothing"), suppress(DrakeTrackerError):
        load_cameras(paths)


def footage(generator, folder):
    """`track` with damaged images (some with EXIF data), videos, bags and calibrations."""
    kind = generator.choice(["images", "photographs", "left.mkv", "left.mjpeg", "bag.mcap", "bag.db3"])
    source, calibration = folder / "here" / kind, folder / "here" / "cameras.yaml"
    text = (BASE / "cameras.yaml").read_text()
    calibration.write_text(mutate_yaml(generator, text, generator.randrange(3)), errors="replace")
    if (BASE / kind).is_dir():
        shutil.copytree(BASE / kind, source)
        for path in generator.sample(sorted(source.iterdir()), generator.randint(1, 2)):
            path.write_bytes(mutate(generator, path.read_bytes(), 1))
    else:
        source.write_bytes(mutate(generator, (BASE / kind).read_bytes(), generator.randint(1, 4)))
    plane = ["--calibration", "cameras.yaml", "--plane", "board"] if generator.random() < 0.7 else []
    options = ["--detector", "FrameDifference {}", "--no-overlay", "--out", "out"]
    options += ["--fps", "30"] if (BASE / kind).is_dir() or kind == "left.mjpeg" else []
    return command(folder, folder / "here" / "out", "track", source.name, *plane, *options)


def arm_description(generator, folder):
    """Descriptions of arms as URDF and SDF."""
    name = generator.choice(["puma560.sdf", "arm.urdf"])
    path = folder / "here" / name
    path.write_bytes(mutate(generator, (BASE / name).read_bytes(), generator.randint(1, 3)))
    with watched(folder, folder / "nothing"), suppress(DrakeTrackerError):
        check_arm(replace(PUMA560, arm_url=path.as_uri()))


def real_process(generator, folder):
    """A command in a process of its own."""
    kind = generator.randrange(3)
    if kind == 0:
        return process(folder, folder / "nothing", "list", write_scenario(generator, folder))
    if kind == 1:
        return process(folder, write_run(generator, folder), "view", "run", "--no-browser", "--port", "0")
    write_run(generator, folder)
    return process(folder, folder / "here" / "out", "replay", "run", "--from", "points", "--out", "out")

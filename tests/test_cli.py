"""The command line: what it passes on, what it prints, and its exit codes. The simulation itself is replaced."""

import errno
import io
import os
import re
import shlex
import signal
import subprocess
import sys
import types
from pathlib import Path

import pytest

from drake_tracker import cli
from drake_tracker.commands import common
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.processes import signals
from drake_tracker.core.progress import Progress, TrialsProgress, time_left
from drake_tracker.run.options import RunOptions
from drake_tracker.scenarios.reader import describe_settings
from drake_tracker.tasks import load_scenario


@pytest.fixture
def simulated(monkeypatch, tmp_path):
    """Replaces `simulate` by a function that records its calls; ``effect`` is what it returns or raises."""
    monkeypatch.chdir(tmp_path)
    seen = types.SimpleNamespace(effect={"success": True}, calls=[])

    def simulate(scenario, out, options, **more):
        seen.calls.append((scenario, {"out": out, "options": options, **more}))
        if isinstance(seen.effect, BaseException):
            raise seen.effect
        return seen.effect

    module = types.ModuleType("drake_tracker.run.simulation")
    module.simulate = simulate
    monkeypatch.setitem(sys.modules, "drake_tracker.run.simulation", module)
    return seen


def test_run_passes_everything_on(simulated, tmp_path):
    out = tmp_path / "mine"
    arguments = ["run", "train:interlaced", "--seed", "7", "--duration", "3", "--set", "track.speed=0.1"]
    arguments += ["--set", "link=!Lossy {drop: 0.5}", "--out", str(out), "--no-record", "--meshcat"]
    assert cli.main(arguments + ["--graphviz", str(tmp_path / "diagram.dot")]) == 0
    scenario, passed = simulated.calls[0]
    assert (scenario.name, scenario.seed, scenario.duration, scenario.track.speed) == ("train:interlaced", 7, 3.0, 0.1)
    assert scenario.link.drop == 0.5
    assert passed.pop("progress") is not None and passed.pop("tell") is not None
    options = RunOptions(record=False, meshcat=True, graphviz=tmp_path / "diagram.dot")
    assert passed == {"out": out, "options": options, "live": None}


@pytest.mark.parametrize("scenario, lag", [("train", "0.25"), ("ball", "0.1"), ("conveyor:measured", "0.25")])
def test_a_run_that_ends_before_the_first_measurement_is_refused(simulated, capsys, scenario, lag):
    assert cli.main(["run", scenario, "--duration", "0.05"]) == 2
    assert simulated.calls == [] and not Path("runs").exists()
    words = (
        f"--duration 0.05: duration: 0.05 s is too short, because the first measurement reaches the arm after {lag} s"
    )
    assert capsys.readouterr().err == f"drake-tracker: {words}\n"


def test_a_live_run_prints_its_link_and_tells_the_page_how_it_ended(simulated, capsys):
    simulated.effect = {"success": False, "failure_reason": "missed", "attempts": 2}
    assert cli.main(["run", "train", "--live"]) == 1
    live = simulated.calls[0][1]["live"]
    printed = capsys.readouterr().out
    assert printed.startswith(f"Live view: {live.url}  ") and live.url.startswith("http://127.0.0.1:")
    outcome = live.state.news(None, 0.0)[0]["facts"]["outcome"]
    assert (outcome["title"], outcome["reason"]) == ("The train was not lifted", "missed")
    assert outcome["rows"] == [("attempts", "2")] and outcome["out"].startswith("runs/train-")


@pytest.mark.parametrize(
    "which, overrides, silence",
    [("train", [], "hold"), ("train", ["--set", "grasp.when_stale=coast"], "coast"), ("mine.yaml", [], "coast")],
)
def test_arm_runs_at_real_time_rate_and_holds_unless_the_scenario_says_otherwise(
    simulated, monkeypatch, tmp_path, which, overrides, silence
):
    from pydrake.lcm import DrakeLcm

    monkeypatch.setattr("drake_tracker.network.bus.open_bus", lambda url: DrakeLcm("memq://"))
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text("mine: {base: train:learned, grasp: {when_stale: coast}}\n")
    arguments = ["arm", which, "--set", "vision=!Measured {}", "--out", str(tmp_path / "run"), "--no-record"]
    assert cli.main(arguments + overrides) == 0
    scenario, passed = simulated.calls[0]
    assert scenario.grasp.when_stale == silence
    assert passed["diagram"].get_name() == "arm_side"
    assert passed["options"] == RunOptions(record=False, realtime_rate=1.0)


@pytest.mark.parametrize("summary, code", [({"success": True}, 0), ({"success": False, "failure_reason": "missed"}, 1)])
def test_the_exit_code_says_whether_the_object_was_grasped(simulated, capsys, summary, code):
    simulated.effect = summary
    assert cli.main(["run", "train"]) == code
    assert "run directory" in capsys.readouterr().out


def test_the_result_is_printed_with_units(simulated, capsys):
    simulated.effect = {"success": True, "time_to_grasp_s": 12.34567, "lift_height_m": None, "attempts": 1}
    cli.main(["run", "train"])
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["time", "to", "grasp", "12.35", "s"] in rows and ["attempts", "1"] in rows
    assert not any("lift" in row for row in rows)


def test_a_ball_has_its_own_rows(simulated, capsys):
    found = {"success": True, "hand_error_m": -0.01234, "board_in_world_error": [0.001, 0.00256]}
    simulated.effect = {**found, "attempts": 1}
    cli.main(["run", "ball"])
    rows = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "caught True: the ball was caught (exit code 0)" in rows and "hand error -12.3 mm" in rows
    assert any(row.startswith("board in world 1.0 mm, 0.15") for row in rows)
    assert not any("attempts" in row for row in rows)


def test_run_directories_are_new_each_time(simulated, tmp_path, monkeypatch):
    monkeypatch.setattr(common.time, "strftime", lambda form: "now")
    for _ in range(3):
        assert cli.main(["run", "train:interlaced"]) == 0
    assert sorted(path.name for path in (tmp_path / "runs").iterdir()) == [
        "train-interlaced-now",
        "train-interlaced-now-2",
        "train-interlaced-now-3",
    ]


def test_a_run_directory_is_never_overwritten(simulated, tmp_path, capsys):
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "summary.json").write_text("{}")
    (tmp_path / "file").write_text("")
    (tmp_path / "empty").mkdir()
    assert cli.main(["run", "train", "--out", "old"]) == 2
    assert cli.main(["run", "train", "--out", "file"]) == 2
    assert simulated.calls == []
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2 and "old is not empty" in lines[0]
    assert (tmp_path / "old" / "summary.json").read_text() == "{}"
    assert cli.main(["run", "train", "--out", "empty"]) == 0


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["run", "trian"], ["did you mean train?"]),
        (["run", "train", "--set", "track.sped=1", "--seed", "-1"], ["did you mean track.speed?", "--seed -1: seed"]),
        (["run", "train", "--duration", "nan"], ["--duration nan: duration must be a number from"]),
        (["arm", "train", "--rate", "-1"], ["--rate -1: must be 0 or more"]),
        (["arm", "train", "--lcm", "here"], ["--lcm here: an address is udpm://GROUP:PORT"]),
        (["host", "train", "--set", "vision=!Measured {}", "--lcm", "here"], ["--lcm here: an address is udpm://"]),
        (["arm", "ball"], ["only the train runs in two processes"]),
        (["host", "ball"], ["only the train runs in two processes"]),
        (["calibrate", "train", "--set", "cameras.distance=2"], ["-o FILE is missing; the package's own calibration"]),
        (["calibrate", "ball", "-o", "x.yaml"], ["ball: this needs a scenario with two fixed cameras"]),
        (["measure", "ball", "-o", "x.yaml"], ["only the error of the train's cameras can be measured"]),
        (["measure", "conveyor", "-o", "x.yaml"], ["only the error of the train's cameras can be measured"]),
        (["host", "conveyor"], ["only the train runs in two processes"]),
        (["run", "conveyor", "--set", "window.y_first=0.42"], ["window.y_first must be less than window.y_last"]),
        (["run", "train", "--graphviz", "no/such/file.dot"], ["--graphviz no/such/file.dot: there is no folder"]),
        (["run", "train", "--graphviz", "/"], ["--graphviz /: this is a folder; name a file"]),
        (["list", "nothing"], ["there is no scenario 'nothing'"]),
    ],
)
def test_bad_input_is_one_line_each_and_leaves_nothing(simulated, capsys, tmp_path, arguments, said):
    assert cli.main(arguments) == 2
    captured = capsys.readouterr()
    lines = captured.err.splitlines()
    assert len(lines) == len(said) and captured.out == ""
    for line, words in zip(lines, said):
        assert line.startswith("drake-tracker: ") and words in line
    assert simulated.calls == [] and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("arguments", ["", "fly", "run", "run train --seed x", "run train --what"])
def test_wrong_usage_is_one_line(capsys, arguments):
    with pytest.raises(SystemExit) as caught:
        cli.main(arguments.split())
    assert caught.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("drake-tracker") and "--help" in line


def test_trouble_in_the_run_is_one_line_and_leaves_no_empty_directory(simulated, capsys, tmp_path):
    simulated.effect = DrakeTrackerError("track.radius = 9 m: the track leaves the arm's reach")
    assert cli.main(["run", "train", "--out", "mine"]) == 2
    *_, line = capsys.readouterr().err.splitlines()
    assert line == "drake-tracker: track.radius = 9 m: the track leaves the arm's reach"
    assert not (tmp_path / "mine").exists()


def test_a_package_that_does_not_load_is_one_line(simulated, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "drake_tracker.run.simulation", None)
    assert cli.main(["run", "train"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "drake-tracker doctor" in line


def test_a_fault_of_the_program_has_its_own_exit_code(simulated, capsys):
    simulated.effect = ZeroDivisionError("in the program")
    assert cli.main(["run", "train"]) == 3
    assert "Traceback" in capsys.readouterr().err


def test_interrupted_runs_say_so(simulated, capsys):
    simulated.effect = KeyboardInterrupt()
    assert cli.main(["run", "train"]) == 128 + signal.SIGINT
    assert capsys.readouterr().err.splitlines()[-1] == "drake-tracker: interrupted"
    simulated.effect = {"success": False, "interrupted": True}
    assert cli.main(["run", "train"]) == 128 + signal.SIGINT


def test_list_shows_the_scenarios_and_the_settings_of_one(monkeypatch, capsys):
    assert cli.main(["list"]) == 0
    assert "train:interlaced" in capsys.readouterr().out
    monkeypatch.setenv("COLUMNS", "110")
    assert cli.main(["list", "train:interlaced"]) == 0
    rows = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "track.speed 0.2 a number from 0 to 1 m/s; mean speed of the train" in rows
    assert any(row.startswith("estimator !ArcLength one of !ClosedPath, !CoordinatedTurn, !ArcLength") for row in rows)


@pytest.mark.parametrize(
    "spec, text, notice",
    [
        ("train:paper", "", "train:paper is now called train"),
        ("mine.yaml", "mine: {base: train:blind}\n", "mine.yaml line 1: train:blind is now called train:learned"),
        (
            "mine.yaml",
            "mine: {seed: 3}\n",
            "mine.yaml: mine rests on the defaults of train, which have changed; write base: train:guided for the "
            "former ones",
        ),
    ],
)
@pytest.mark.parametrize(
    "command",
    [
        ["list"],
        ["run", "--no-record"],
        ["arm", "--no-record", "--set", "vision=!Measured {}"],
        ["campaign", "--trials", "2", "--vary", "track.speed=0.1,0.3", "--vision", "measured"],
    ],
)
def test_a_notice_is_one_line_and_the_command_succeeds(
    simulated, campaign, monkeypatch, capsys, command, spec, text, notice
):
    from pydrake.lcm import DrakeLcm

    monkeypatch.setattr("drake_tracker.network.bus.open_bus", lambda url: DrakeLcm("memq://"))
    Path("mine.yaml").write_text(text)
    for _ in range(2):  # the second command of a process prints it as well
        assert cli.main([command[0], spec, *command[1:]]) == 0
        notices = [line for line in capsys.readouterr().err.splitlines() if line.startswith("drake-tracker: ")]
        assert notices == [f"drake-tracker: {notice}"]


def test_a_scenario_without_a_notice_prints_none(capsys):
    assert cli.main(["list", "train"]) == 0
    assert capsys.readouterr().err == ""


def settings_listed(capsys, *arguments):
    assert cli.main(["list", *arguments]) == 0
    lines = capsys.readouterr().out.splitlines()
    return [line.split()[0] for line in lines if re.match(r"  [a-z][a-z_.]*  ", line + "  ")]


@pytest.mark.parametrize("task", ["train", "ball", "conveyor"])
def test_list_shows_the_settings_that_people_change_or_all_or_those_of_another_kind(monkeypatch, capsys, task):
    monkeypatch.setenv("COLUMNS", "200")
    few, every = settings_listed(capsys, task), settings_listed(capsys, task, "--all")
    assert 20 < len(few) <= 40 and set(few) < set(every)
    if task == "train":
        assert "estimator.bend_noise" in settings_listed(capsys, task, "--set", "estimator=!CoordinatedTurn {}")
    known = load_scenario(task).COMMON
    unknown = [key for key in known if key not in every and not key.startswith(("link.", "vision.method."))]
    assert unknown == []


@pytest.mark.parametrize("columns", [60, 90])
def test_list_fits_the_terminal_and_has_a_section_for_each_part(monkeypatch, capsys, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    assert cli.main(["list", "train", "--all"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= columns
    headings = [line.partition(":")[0] for before, line in zip(["", *lines], lines) if not before and line]
    assert headings[:3] == ["train", "track", "train"] and {"vision", "estimator", "grasp", "arm"} < set(headings)
    assert {key for key, *_ in describe_settings(load_scenario("train:learned"))} <= {
        line.split()[0] for line in lines if line
    }


def test_calibrate_hands_over_to_the_calibration(monkeypatch, tmp_path):
    module = types.ModuleType("drake_tracker.calibration.rendered_boards")
    calls = []
    module.calibrate = lambda scenario, path: calls.append((scenario.name, scenario.cameras.noise, path))
    monkeypatch.setitem(sys.modules, "drake_tracker.calibration.rendered_boards", module)
    path = tmp_path / "cameras.yaml"
    assert cli.main(["calibrate", "train", "--set", "cameras.noise=0", "-o", str(path)]) == 0
    assert calls == [("train", 0.0, path)]


class Terminal(io.StringIO):
    def isatty(self):
        return True


def run_for(stream, seconds, step):
    """Shows a run at twice real time for some wall seconds."""
    now = [0.0]
    progress = Progress(60.0, stream, clock=lambda: now[0])
    while now[0] <= seconds:
        progress(2.0 * now[0], "track")
        now[0] += step
    progress.close()
    return stream.getvalue()


def test_progress_rewrites_one_line_on_a_terminal_and_clears_it():
    shown = run_for(Terminal(), 2.0, 0.01)
    assert "\n" not in shown
    lines = shown.split("\r")
    assert 9 <= len(lines) <= 13
    assert "track" in lines[5] and "2.00x real time, at most 29 s left" in lines[5] and "s of 60" in lines[5]
    assert lines[-1] == "\x1b[K"


def test_progress_fits_on_one_line_of_the_terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "60")
    stream, times = Terminal(), iter([0.0, 1.0, 2.0])
    progress = Progress(60.0, stream, clock=lambda: next(times))
    progress(1.0, "track: waiting for " + "predictions from this place that come true" * 3)
    assert len(stream.getvalue().removeprefix("\r").removesuffix("\x1b[K")) == 59


def test_progress_prints_a_line_now_and_then_without_a_terminal():
    assert run_for(io.StringIO(), 5.0, 0.1) == ""
    lines = run_for(io.StringIO(), 35.0, 0.1).splitlines()
    assert len(lines) == 3 and "\x1b" not in lines[0]


def campaign_command(*more):
    return ["campaign", "train", "--trials", "2", "--vary", "track.speed=0.1,0.3", "--vision", "measured", *more]


@pytest.fixture
def campaign(monkeypatch, tmp_path):
    """Replaces the workers by a runner in this process; ``effect`` is what ends it early."""
    monkeypatch.chdir(tmp_path)
    seen = types.SimpleNamespace(effect=None, after=2, workers=None)

    def pool(workers):
        seen.workers = workers

        def run(work, jobs):
            for count, trial in enumerate(jobs):
                if seen.effect is not None and count == seen.after:
                    raise seen.effect
                yield trial, {"settings": trial.settings, "seed": trial.scenario.seed, "success": False}

        return run

    monkeypatch.setattr("drake_tracker.campaign.run.pool", pool)
    return seen


def test_a_campaign_that_ran_is_a_success_whatever_its_rates(campaign, capsys, tmp_path):
    assert cli.main(campaign_command("--workers", "1", "--out", "c")) == 0
    assert campaign.workers == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:3] == ["track.speed", "successes", "trials"] and lines[1].split()[:3] == ["0.1", "0", "2"]
    assert "trials.csv" in lines[-1] and (tmp_path / "c" / "success.png").exists()


def test_an_interrupted_campaign_says_so_and_can_be_continued(campaign, capsys, tmp_path):
    campaign.effect = KeyboardInterrupt()
    assert cli.main(campaign_command("--out", "c")) == 128 + signal.SIGINT
    assert "interrupted; finished trials are kept, continue with --out c" in capsys.readouterr().err
    campaign.effect = None
    assert cli.main(campaign_command("--out", "c")) == 0
    captured = capsys.readouterr()
    assert "2 of 4" in captured.err and captured.out.splitlines()[3].split()[:3] == ["all", "0", "4"]


@pytest.mark.parametrize(
    "arguments, said",
    [
        (campaign_command("--vary", "track.sped=1"), ["--vary track.sped=1: there is no setting"]),
        (campaign_command("--vary", "track.speed=1"), ["track.speed is varied twice"]),
        (campaign_command("--trials", "0"), ["--trials 0: must be"]),
        (campaign_command("--workers", "0"), ["--workers 0: must be"]),
        (["campaign", "ball", "--trials", "1", "--vision", "measured"], ["--vision measured: vision must be one of"]),
    ],
)
def test_bad_campaigns_are_one_line_each_and_leave_nothing(campaign, capsys, tmp_path, arguments, said):
    assert cli.main(arguments) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == len(said) and all(words in line for words, line in zip(said, lines)), lines
    assert list(tmp_path.iterdir()) == []


def test_a_campaign_into_something_else_is_one_line(campaign, capsys, tmp_path):
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "summary.json").write_text("{}")
    (tmp_path / "file").write_text("")
    assert cli.main(campaign_command("--out", "old")) == 2
    assert cli.main(campaign_command("--out", "file")) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2 and "old is not empty and holds no campaign" in lines[0] and "file" in lines[1]


class Clock:
    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


def test_a_run_that_ended_because_its_terminal_was_closed_has_the_code_of_the_signal(simulated, monkeypatch):
    monkeypatch.setattr(sys, "stdout", ClosedTerminal())
    monkeypatch.setattr(sys, "stderr", ClosedTerminal())
    simulated.effect = {"success": False, "interrupted": True}
    monkeypatch.setattr(signals, "received", lambda: signal.SIGHUP)
    assert cli.main(["run", "train"]) == 129


class ClosedTerminal(Terminal):
    def write(self, text):
        raise OSError(errno.EIO, "Input/output error")


def test_a_closed_terminal_does_not_end_a_run():
    progress = Progress(10.0, ClosedTerminal())
    progress.say("Building")
    progress(1.0, "track")
    progress.close()


def test_the_progress_of_trials_shows_the_time_left():
    clock, stream = Clock(), Terminal()
    progress = TrialsProgress(stream, clock)
    for now, ended in ((0.0, 10), (60.0, 20), (60.1, 21), (120.0, 30)):
        clock.now = now
        progress(ended, 40, ended // 2)
    progress.close()
    shown = stream.getvalue().split("\r")
    assert len(shown) == 5 and "\n" not in stream.getvalue() and shown[-1] == "\x1b[K"
    assert "10 of 40  succeeded 5" in shown[1] and "left" not in shown[1]
    assert "20 of 40  succeeded 10  10.0 per minute  2 min 00 s left" in shown[2]
    assert shown[2].startswith("[############............]")


def test_the_progress_of_trials_is_plain_lines_without_a_terminal():
    clock, stream = Clock(), io.StringIO()
    progress = TrialsProgress(stream, clock)
    for now in range(13):
        clock.now = float(now)
        progress(now, 12, 0)
    progress.close()
    lines = stream.getvalue().splitlines()
    assert [line.split("] ")[1].split("  ")[0] for line in lines] == ["0 of 12", "10 of 12", "12 of 12"]


@pytest.mark.parametrize("missing, words", [(5, "50 s"), (10, "1 min 40 s"), (1000, "2 h 46 min")])
def test_time_left_in_words(missing, words):
    assert time_left(10.0, 1, missing) == words


@pytest.mark.parametrize("command", ["", *[module.__name__.rpartition(".")[2] for module in cli.COMMANDS]])
def test_every_help_text_names_the_next_useful_command(capsys, command):
    command = {"list_scenarios": "list"}.get(command, command).replace("_", "-")
    with pytest.raises(SystemExit) as caught:
        cli.main([*command.split(), "--help"])
    assert caught.value.code == 0
    printed = capsys.readouterr().out
    assert command == "figures" or "\nNext: drake-tracker " in printed
    assert max(map(len, printed.splitlines())) <= 80


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_completion_script_knows_commands_and_options(capsys, shell):
    assert cli.main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert "calibrate" in script and "record-images" in script


@pytest.mark.parametrize(
    "line, words",
    [
        ("run train:gui", {"guided"}),
        ("run train --set track.sp", {"track.speed="}),
        ("run train --set track.speed=0.2 --set estim", {"estimator=ArcLength", "estimator=Custom"}),
        ("run train --set estimator=Coord", {"CoordinatedTurn"}),
        ("list conv", {"conveyor", "conveyor:ur5e"}),
    ],
)
def test_bash_completes_scenarios_and_settings(capsys, line, words):
    assert cli.main(["completion", "bash"]) == 0
    script = capsys.readouterr().out
    line = f"drake-tracker {line}"
    asked = f"COMP_LINE={shlex.quote(line)} COMP_POINT={len(line)}; _drake_tracker; echo ${{COMPREPLY[*]}}"
    child = subprocess.run(["bash", "-c", f"{script}\n{asked}"], capture_output=True, text=True, check=True)
    assert words <= set(child.stdout.split()), child.stdout


def test_drakes_messages_do_not_interrupt_the_output(tmp_path):
    code = (
        "from drake_tracker.commands.common import quiet_drake\n"
        "quiet_drake()\nfrom pydrake.geometry import Meshcat\nMeshcat()"
    )
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=True)
    assert child.stdout + child.stderr == ""


@pytest.mark.parametrize(
    "arguments", [["track", "caf\udce9.mp4"], ["view", "\udcff"], ["run", "train", "--out", "o\udce9"]]
)
def test_a_name_that_is_not_utf_8_is_refused_at_the_start(capfd, arguments):
    assert cli.main(arguments) == 2
    assert capfd.readouterr().err.endswith(
        ": this name is not UTF-8, and could not be written into results; rename the file\n"
    )


def test_an_ascii_locale_is_named(tmp_path):
    """Drake's package cannot be imported then; commands without Drake can be used."""
    environment = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONPATH": str(Path(__file__).parents[1])}
    command = [sys.executable, "-m", "drake_tracker"]
    listed = subprocess.run([*command, "list"], capture_output=True, env=environment, cwd=tmp_path, check=True)
    assert b"train" in listed.stdout
    run = subprocess.run([*command, "run", "train"], capture_output=True, env=environment, cwd=tmp_path, check=False)
    assert run.returncode == 2 and run.stderr.splitlines()[-1].endswith(
        b"(initialization failed); Drake needs UTF-8 names: set PYTHONUTF8=1, or a locale such as C.UTF-8"
    )

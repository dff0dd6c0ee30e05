"""Runs or continues a campaign, and writes its directory."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_tracker.campaign.directory import Record, discard, open_directory
from drake_tracker.campaign.plan import CampaignPlan, Lost, Trial, key_of, make_plan, run_trial
from drake_tracker.campaign.pool import Runner, pool, workers_or_all
from drake_tracker.campaign.rates import Rate, rate_columns, rate_table, rates_of
from drake_tracker.campaign.table import columns_of, require_parquet, write_csv, write_parquet
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.core.processes.signals import held
from drake_tracker.scenarios.consent import allowed_code
from drake_tracker.scenarios.reader import setting_unit
from drake_tracker.world.imaging.image_pipeline import VARIABLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLE, RATES, PICTURE = "trials.csv", "rates.csv", "success.png"
"""Names of the files that a campaign leaves beside its record."""

OnProgress = Callable[[int, int, int], object]
"""Called with (number of trials that have ended, number of all trials, number of successes)."""


@dataclass(frozen=True)
class Campaign:
    """The results of a campaign.

    Attributes:
        plan: of the campaign.
        rows: lines of its record, cell by cell and seed by seed, lines of earlier calls included.
        lost: (trial, reason) of each trial that could not be completed this time. It has no line, and the next call
            runs it again.
        interrupted: whether the user stopped the campaign.
        notes: a line for each repaired defect of its record.
    """

    plan: CampaignPlan
    rows: list[dict[str, Any]]
    lost: list[tuple[Trial, str]]
    interrupted: bool
    notes: tuple[str, ...] = ()

    @property
    def rates(self) -> list[Rate]:
        """The `rates.Rate` of each cell."""
        return rates_of(self.rows, [cell.settings for cell in self.plan.cells])

    @property
    def table(self) -> dict[str, list[Any]]:
        """{column: values}, with one value per trial; see `table.columns_of`."""
        return columns_of(self.rows, list(self.plan.vary))

    def lines(self) -> list[str]:
        """Returns the rates as lines of text, then the trials that were lost."""
        lines = rate_table(self.rates, list(self.plan.vary))
        for trial, reason in self.lost:
            lines.append(f"lost: {describe(trial)}: {reason}; the same command runs it again")
        return lines

    def draw(self) -> Figure | None:
        """Returns a Matplotlib figure of the rates, or None when nothing was varied."""
        from drake_tracker.campaign.plots import draw_rates  # Matplotlib is slow to load

        return draw_rates(self.rates, list(self.plan.vary), units_of(self.plan), self.plan.spec)


def run_campaign(
    scenario: str,
    trials: int,
    vary: Mapping[str, Sequence[Any]] | None = None,
    overrides: Sequence[str] = (),
    first_seed: int = 0,
    vision: str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    out: str | os.PathLike[str] | None = None,
    parquet: bool = False,
    progress: OnProgress | None = None,
    allow_code: bool | None = None,
    say: Callable[[str], object] | None = None,
) -> Campaign:
    """Runs every trial of a campaign that has not been run yet. Returns the `Campaign`.

    Raises DrakeTrackerError for bad input, before anything runs, and when the scheduler or the disk fails; the trials
    recorded until then are kept.

    Args:
        scenario: see `make_plan`.
        trials: see `make_plan`.
        vary: see `make_plan`.
        overrides: see `make_plan`.
        first_seed: see `make_plan`.
        vision: see `make_plan`.
        workers: number of processes of this machine; by default one for each core.
        scheduler: address of a dask scheduler, to run on its workers instead; see `cluster.cluster`.
        out: directory of the campaign, a new one or one to continue; None writes nothing.
        parquet: whether the table is also written as Parquet.
        progress: called at the start and after each trial.
        allow_code: see `make_plan`.
        say: called, before anything runs, with a line for each piece of code that the scenario file names.
    """
    plan = make_plan(scenario, trials, vary, overrides, first_seed, vision, allow_code)
    runner = make_runner(workers, scheduler)
    if parquet:
        require_parquet()
    _check_parts(plan, say)
    if scheduler is None:
        _require_renderer(plan)
    return carry_out(plan, runner, out, parquet, progress)


def make_runner(workers: int | None = None, scheduler: str | None = None) -> Runner:
    """Returns the `pool.Runner` of a campaign. Raises DrakeTrackerError when the arguments do not describe one.

    Args:
        workers: number of processes of this machine; by default one for each core.
        scheduler: address of a dask scheduler, to run on its workers instead.
    """
    if scheduler is not None:
        from drake_tracker.campaign.cluster import cluster

        if workers is not None:
            raise DrakeTrackerError(f"--workers {workers}: is for this machine; a scheduler has its own workers")
        return cluster(scheduler)
    if workers is not None and workers < 1:
        raise DrakeTrackerError(f"--workers {workers}: must be a whole number from 1")
    return pool(workers_or_all(workers))


def carry_out(
    plan: CampaignPlan,
    runner: Runner,
    out: str | os.PathLike[str] | None = None,
    parquet: bool = False,
    progress: OnProgress | None = None,
    work: Callable[[Trial], Any] = run_trial,
) -> Campaign:
    """Runs the missing trials of a plan. Returns the `Campaign`; see `run_campaign`.

    Args:
        plan: of the campaign.
        runner: runs the trials.
        out: directory of the campaign, or None.
        parquet: whether the table is also written as Parquet.
        progress: called at the start and after each trial.
        work: runs one trial, and returns its line of the record or `Lost`.
    """
    with open_directory(plan, out) as record:
        done = {key_of(row["settings"], row["seed"]) for row in record.rows}
        missing = [trial for trial in plan.jobs() if trial.key not in done]
        try:
            lost, interrupted = _run(runner, work, missing, record, len(plan), progress)
        except DrakeTrackerError as error:
            if out is None:
                raise
            if not record.rows:
                discard(out)
                raise
            kept = f"{len(record.rows)} of {len(plan)} trials are kept, continue with --out {out}"
            raise DrakeTrackerError(f"{error}; {kept}") from None
        places = {trial.key: (k % len(plan.cells), k) for k, trial in enumerate(plan.jobs())}
        rows = [row for row in record.rows if key_of(row["settings"], row["seed"]) in places]
        rows.sort(key=lambda row: places[key_of(row["settings"], row["seed"])])
        campaign = Campaign(plan, rows, lost, interrupted, tuple(record.notes))
        if out is not None and rows:
            with held():
                _write(campaign, Path(out), parquet)
    return campaign


def _run(
    runner: Runner,
    work: Callable[[Trial], Any],
    missing: Sequence[Trial],
    record: Record,
    count: int,
    progress: OnProgress | None,
) -> tuple[list[tuple[Trial, str]], bool]:
    """Returns ((trial, reason) of each lost trial, whether the user stopped the campaign)."""
    lost: list[tuple[Trial, str]] = []
    ended = count - len(missing)
    successes = sum(bool(row["success"]) for row in record.rows)
    try:
        with closing(runner(work, missing)) as results:
            if progress is not None:
                progress(ended, count, successes)
            for trial, result in results:
                if isinstance(result, Lost):
                    lost.append((trial, result.reason))
                else:
                    record.append(result)
                    successes += bool(result["success"])
                ended += 1
                if progress is not None:
                    progress(ended, count, successes)
    except KeyboardInterrupt:
        return lost, True
    return lost, False


def _check_parts(plan: CampaignPlan, say: Callable[[str], object] | None) -> None:
    """Announces the code that will run, and makes the custom parts of each cell, which loading a scenario does not
    make.

    Raises DrakeTrackerError when one of them is not allowed or cannot be made.
    """
    from drake_tracker.diagrams.parts import check_custom_parts

    for line in dict.fromkeys(line for cell in plan.cells for line in allowed_code(cell.scenario)):
        if say is not None:
            say(line)
    for cell in plan.cells:
        check_custom_parts(cell.scenario)


def _require_renderer(plan: CampaignPlan) -> None:
    from drake_tracker.core.system_check import require_renderer

    if renders(plan):
        require_renderer()


def renders(plan: CampaignPlan) -> bool:
    """Returns whether trials of a plan render images."""
    from drake_tracker.tasks.registry import task_of

    return any(task_of(cell.scenario).uses_cameras(cell.scenario) for cell in plan.cells)


def chooses_rendering(plan: CampaignPlan) -> bool:
    """Returns whether trials of a plan render images, and no setting or variable says in which processes."""
    lenses = [getattr(cell.scenario, "cameras", None) or cell.scenario.camera for cell in plan.cells]
    automatic = all(lens.render_processes == "auto" for lens in lenses) and VARIABLE not in os.environ
    return renders(plan) and automatic


def _write(campaign: Campaign, out: Path, parquet: bool) -> None:
    """Writes the tables and the picture of a campaign to its directory."""
    table = campaign.table
    write_csv(table, out / TABLE)
    if parquet:
        write_parquet(table, (out / TABLE).with_suffix(".parquet"))
    write_csv(rate_columns(campaign.rates, list(campaign.plan.vary)), out / RATES)
    figure = campaign.draw()
    if figure is not None:
        with replacing(out / PICTURE) as beside:
            figure.savefig(beside, dpi=110)


def describe(trial: Trial) -> str:
    """Returns seed and varied settings of a trial, in one line."""
    return ", ".join([f"seed {trial.scenario.seed}", *(f"{key} {value}" for key, value in trial.settings.items())])


def units_of(plan: CampaignPlan) -> dict[str, str]:
    """Returns {key: unit} of the varied settings that have a unit."""
    return {key: unit for key in plan.vary if (unit := setting_unit(type(plan.cells[0].scenario), key))}

"""Runs a campaign, or goes on with one, and leaves its directory."""

import os
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from drake_tracker.campaign.directory import discard, open_directory, replace_whole
from drake_tracker.campaign.plan import Plan, key_of, make_plan
from drake_tracker.campaign.pool import pool
from drake_tracker.campaign.rates import rate_columns, rate_table, rates_of
from drake_tracker.campaign.table import columns_of, require_parquet, write_csv, write_parquet
from drake_tracker.campaign.trial import Lost, run_trial
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.scenarios.reader import setting_unit

TABLE, RATES, PICTURE = "trials.csv", "rates.csv", "success.png"
"""Names of the files that a campaign leaves beside its record."""


@dataclass(frozen=True)
class Campaign:
    """What came of a campaign.

    plan: the `Plan`. rows: the lines of its record, cell by cell and seed by seed, those of earlier calls as well.
    lost: [(Trial, reason)] that did not come to an end this time; they have no line and are run by the next call.
    interrupted: whether the user ended it.
    """

    plan: Plan
    rows: list
    lost: list
    interrupted: bool

    @property
    def rates(self):
        """A `rates.Rate` of each cell."""
        return rates_of(self.rows, [cell.settings for cell in self.plan.cells])

    @property
    def table(self):
        """{column: values}, a value a trial; see `table.columns_of`."""
        return columns_of(self.rows, list(self.plan.vary))

    def lines(self):
        """Returns the rates as lines of text, then the trials that were lost."""
        lines = rate_table(self.rates, list(self.plan.vary))
        for trial, reason in self.lost:
            lines.append(f"lost: {describe(trial)}: {reason}; the same command runs it again")
        return lines

    def draw(self):
        """Returns a Matplotlib figure of the rates, or None when nothing was varied."""
        from drake_tracker.campaign.plots import draw_rates  # Matplotlib is slow to load

        return draw_rates(self.rates, list(self.plan.vary), units_of(self.plan), self.plan.spec)


def run_campaign(
    scenario,
    trials,
    vary=None,
    overrides=(),
    first_seed=0,
    vision=None,
    workers=None,
    scheduler=None,
    out=None,
    parquet=False,
    progress=None,
):
    """Runs every trial of a campaign that has not been run yet; returns the `Campaign`.

    Args:
      scenario, trials, vary, overrides, first_seed, vision: see `make_plan`.
      workers: processes of this machine, by default one for each core.
      scheduler: address of a dask scheduler, to run on its workers instead; see `cluster`.
      out: directory of the campaign, new, or that of one to go on with; None leaves nothing behind.
      parquet: whether the table is written as Parquet, too.
      progress: called with (trials that have ended, all trials, how many took the object) after each.

    Raises DrakeTrackerError on bad input, before anything runs, and when the scheduler or the disk fails; what has been
    recorded until then is kept.
    """
    plan = make_plan(scenario, trials, vary, overrides, first_seed, vision)
    runner = make_runner(workers, scheduler)
    if parquet:
        require_parquet()
    if scheduler is None:
        _require_renderer(plan)
    return carry_out(plan, runner, out, parquet, progress)


def make_runner(workers=None, scheduler=None):
    """Returns the runner of a campaign: see `pool.pool`. Raises DrakeTrackerError for one that cannot be."""
    if scheduler is not None:
        from drake_tracker.campaign.cluster import cluster

        if workers is not None:
            raise DrakeTrackerError(f"--workers {workers}: is for this machine; a scheduler has workers of its own")
        return cluster(scheduler)
    if workers is not None and workers < 1:
        raise DrakeTrackerError(f"--workers {workers}: must be a whole number from 1")
    return pool(workers or os.cpu_count())


def carry_out(plan, runner, out=None, parquet=False, progress=None, work=run_trial):
    """Runs what is missing of a `Plan` with ``work(trial)`` on a runner; see `run_campaign`."""
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
            kept = f"{len(record.rows)} of {len(plan)} trials are kept, go on with --out {out}"
            raise DrakeTrackerError(f"{error}; {kept}") from None
        places = {trial.key: (k % len(plan.cells), k) for k, trial in enumerate(plan.jobs())}
        rows = [row for row in record.rows if key_of(row["settings"], row["seed"]) in places]
        rows.sort(key=lambda row: places[key_of(row["settings"], row["seed"])])
        campaign = Campaign(plan, rows, lost, interrupted)
        if out is not None and rows:
            _write(campaign, Path(out), parquet)
    return campaign


def _run(runner, work, missing, record, count, progress):
    """Returns ([(Trial, reason)] of those lost, whether the user ended it)."""
    lost, ended = [], count - len(missing)
    taken = sum(bool(row["success"]) for row in record.rows)
    try:
        with closing(runner(work, missing)) as results:
            if progress is not None:
                progress(ended, count, taken)
            for trial, result in results:
                if isinstance(result, Lost):
                    lost.append((trial, result.reason))
                else:
                    record.append(result)
                    taken += bool(result["success"])
                ended += 1
                if progress is not None:
                    progress(ended, count, taken)
    except KeyboardInterrupt:
        return lost, True
    return lost, False


def _require_renderer(plan):
    from drake_tracker.core.machine import require_renderer
    from drake_tracker.tasks.registry import task_of

    if any(task_of(cell.scenario).needs_renderer(cell.scenario) for cell in plan.cells):
        require_renderer()


def _write(campaign, out, parquet):
    """Leaves the tables and the picture of a campaign in its directory."""
    table = campaign.table
    write_csv(table, out / TABLE)
    if parquet:
        write_parquet(table, (out / TABLE).with_suffix(".parquet"))
    write_csv(rate_columns(campaign.rates, list(campaign.plan.vary)), out / RATES)
    figure = campaign.draw()
    if figure is not None:
        replace_whole(out / PICTURE, lambda beside: figure.savefig(beside, dpi=110))


def describe(trial):
    """Returns in words which trial it is."""
    return ", ".join([f"seed {trial.scenario.seed}", *(f"{key} {value}" for key, value in trial.settings.items())])


def units_of(plan):
    """Returns {key: unit} of the varied settings that have one."""
    return {key: unit for key in plan.vary if (unit := setting_unit(type(plan.cells[0].scenario), key))}

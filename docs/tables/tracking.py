"""Tracking lap after lap (`results/tracking_arc_length.json`)."""

from result_tables import tracking_tables as benchmark

from tables.results import block, data, sidecar, table


def tracking_laps() -> str:
    results, made_by = data("tracking_arc_length"), sidecar("tracking_arc_length")
    seed = ", ".join(map(str, made_by["seeds"]))
    note = 'Intervals of the fitted line: 95 %; "single laps" is their standard deviation about the line.'
    return block(table(*benchmark.laps_table(results)), f"*Seed {seed}, commit `{made_by['commit'][:7]}`. {note}*")


def tracking_last_lap() -> str:
    texts = []
    for result in data("tracking_arc_length"):
        error, jerk = benchmark.last_against_second(result)
        texts.append(
            f"{result['direction']}, lap {result['last_lap']} against lap 2: error {error:+.1%}, jerk {jerk:+.1%}"
        )
    return f"{'; '.join(texts).replace('%', ' %')}."


def tracking_bias() -> str:
    return table(*benchmark.bias_table(data("tracking_arc_length")))

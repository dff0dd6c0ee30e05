"""The Kaiser window of section 4.3 and its response, for which the paper has no figure."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.estimation.parts.kaiser import kaiser_beta, kaiser_order
from drake_tracker.figures.paper_style import MINUS, head, quiet_grid, sheet
from drake_tracker.tasks.style import FAR_PREDICTED, PREDICTED, SEEN, SOFT_INK

ATTENUATION, TRANSITION = 30.0, 0.05
"""Attenuation A [dB] and width of the transition [fraction of the sampling rate] of the paper."""
FLOOR = -60.0
"""Lowest response shown [dB]."""


def kaiser_response() -> dict[str, Any]:
    """Returns the taps of the window, its response [dB] over the frequency [Hz] at 60 Hz, and its figures of merit.

    For comparison it also returns the responses of a rectangular window of the same length, and of the windowed sinc
    for which Kaiser's formulas are made, with its cut-off at the width of the transition.
    """
    order, beta = kaiser_order(ATTENUATION, TRANSITION), kaiser_beta(ATTENUATION)
    rate = 1.0 / VISION_PERIOD
    window = np.kaiser(order + 1, beta)
    n = np.arange(order + 1)
    sinc = window * np.sinc(2.0 * TRANSITION * (n - 0.5 * order))
    frequency = np.linspace(0.0, 0.5 * rate, 1201)
    responses = {
        name: _decibels(taps / taps.sum(), frequency / rate)
        for name, taps in (("kaiser", window), ("rectangular", np.ones(order + 1)), ("windowed_sinc", sinc))
    }
    kaiser = responses["kaiser"]
    first_null = int(np.nonzero(np.diff(kaiser) > 0.0)[0][0])
    return {
        "attenuation_db": ATTENUATION,
        "transition_hz": TRANSITION * rate,
        "order": order,
        "beta": beta,
        "delay_s": 0.5 * order * VISION_PERIOD,
        "white_noise_gain": float(np.sum((window / window.sum()) ** 2)),
        "half_amplitude_hz": frequency[np.argmax(kaiser < -6.02)],
        "first_null_hz": frequency[first_null],
        "highest_side_lobe_db": kaiser[first_null:].max(),
        "highest_side_lobe_rectangular_db": _side_lobe(responses["rectangular"]),
        "highest_side_lobe_windowed_sinc_db": _side_lobe(responses["windowed_sinc"]),
        "window": window,
        "frequency_hz": frequency,
        "response_db": responses,
    }


def _decibels(taps: np.ndarray, frequency: np.ndarray) -> np.ndarray:
    """Returns the amplitude response [dB] of taps at frequencies (n,) [fraction of the sampling rate]."""
    response = np.exp(-2j * np.pi * frequency[:, None] * np.arange(len(taps))) @ taps
    return 20.0 * np.log10(np.maximum(np.abs(response), 1e-9))


def _side_lobe(response: np.ndarray) -> float:
    return response[np.nonzero(np.diff(response) > 0.0)[0][0] :].max()


def draw_kaiser_response(numbers: Mapping[str, Any]) -> Figure:
    """Returns the figure: the window on the left, its response on the right."""
    with sheet(12.0, 5.0) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.6))
        n = np.arange(numbers["order"] + 1)
        left.vlines(n, 0.0, numbers["window"], color=PREDICTED, lw=1.6)
        left.plot(n, numbers["window"], "o", color=PREDICTED, ms=4.5)
        left.set(xlabel="frame $n$", ylabel="$w_K(n)$", ylim=(0, 1.08))
        head(
            left,
            "Section 4.3 · The Kaiser window",
            f"M = {numbers['order']}, $\\beta$ = {numbers['beta']:.2f}: {numbers['order'] + 1} taps, "
            f"a delay of {numbers['delay_s']:.2f} s",
        )
        for name, label, look in (
            ("rectangular", "rectangular, same length", dict(color=SEEN, lw=1.3)),
            ("windowed_sinc", "sinc in a Kaiser window", dict(color=FAR_PREDICTED, lw=1.5, ls=(0, (4, 2)))),
            ("kaiser", "Kaiser alone, as in the paper", dict(color=PREDICTED, lw=2.2)),
        ):
            response = np.maximum(numbers["response_db"][name], FLOOR - 20.0)
            right.plot(numbers["frequency_hz"], response, label=label, **look)
        reached = f"{MINUS}{-numbers['highest_side_lobe_db']:.1f} dB"
        wanted = f"{MINUS}A = {MINUS}{numbers['attenuation_db']:.0f} dB"
        for level, text in ((numbers["highest_side_lobe_db"], reached), (-numbers["attenuation_db"], wanted)):
            right.axhline(level, color=SOFT_INK, lw=0.9, ls=(0, (2, 2)), zorder=0)
            right.annotate(
                text,
                (1.0, level),
                xycoords=("axes fraction", "data"),
                xytext=(-2, 3),
                ha="right",
                textcoords="offset points",
                color=SOFT_INK,
                fontsize=10,
            )
        right.set(
            xlim=(0, numbers["frequency_hz"][-1]),
            ylim=(FLOOR, 3),
            xlabel="frequency  [Hz], sampled at 60 Hz",
            ylabel="response  [dB]",
        )
        quiet_grid(right)
        right.legend(loc="lower left", bbox_to_anchor=(0.5, 0.80))
        head(
            right,
            "Its response",
            f"Side lobes of the window alone reach {reached}; those of a windowed sinc come close to {MINUS}A.",
        )
    return figure

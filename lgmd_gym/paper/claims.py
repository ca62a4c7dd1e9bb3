"""The paper's claims, compared with measurements."""

import csv
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.table import Table
from rich.text import Text

from lgmd_gym.clips.detection import ClipDetection, summarize_detections
from lgmd_gym.clips.playback import PLAYBACK_CONFIGS
from lgmd_gym.clips.study import HEADLINE, markdown_table
from lgmd_gym.paper.experiments import (
    CONTACT,
    DARK,
    L_OVER_V,
    LIGHT,
    SHADES,
    ExperimentResults,
    GratingResponse,
    StimulusResponse,
    line_fit,
)

HOLDS, PARTLY, FAILS = "holds", "in part", "does not hold"
RESTING = 0.5005  # K at rest, with the rounding of float32
# Gabbiani, Krapp & Laurent (J. Neurosci. 1999): the peak occurs 27 ms after the angle passes 24 deg.
LOCUST_SLOPE = 1.0 / math.tan(math.radians(12.0))
MIN_SELECTIVITY = 1.0 / 3.0  # selectivity index of twice as many spikes in approach as in recession


class ClaimResult(NamedTuple):
    """One row of the table of claims."""

    claim: str  # claim of the paper
    measured: str  # measurement, in words
    result: str  # `HOLDS`, `PARTLY` or `FAILS`
    factor: str  # parameter or stimulus property that the result depends on


def evaluate_claims(
    results: ExperimentResults, clips: Sequence[ClipDetection] | None = None
) -> list[ClaimResult]:
    """Return the result of every claim.

    Args:
        results: Results of the experiments on synthetic stimuli.
        clips: Detections of driving clips at the setting of the paper, `HEADLINE`; None without clips.
    """
    rows = [*_gratings(results), _looming(results), _light(results), *_panorama(results), _ablation(results)]
    rows += _biology(results)
    return rows + ([] if clips is None else _clips(clips))


def _grade(passed: int, total: int) -> str:
    return HOLDS if passed == total else FAILS if passed == 0 else PARTLY


def _count_silent(responses: list[GratingResponse], model: str) -> int:
    return sum(response.potential[model] <= RESTING for response in responses)


def _gratings(results: ExperimentResults) -> list[ClaimResult]:
    full, low = results.gratings, results.low_contrast
    silent, silent_cold = _count_silent(full, "paper"), _count_silent(full, "no warm start")
    full_contrast = ClaimResult(
        "gratings alone: K stays 0.5 (full contrast)",
        f"silent on {silent} of {len(full)} gratings, from the first frame; on {silent_cold} without the "
        "warm start",
        _grade(silent, len(full)),
        "warm start of the filters",
    )
    spiking = [item.grating for item in low if item.potential["paper"] > RESTING]
    names = ", ".join(f"{grating.contrast:g} at {grating.temporal:g} Hz" for grating in spiking)
    all_contrasts = ClaimResult(
        "gratings alone: K stays 0.5 (contrast 0.05 to 1)",
        f"silent on {len(low) - len(spiking)} of {len(low)}"
        + (f"; K = 1 for contrast {names}" if names else ""),
        _grade(len(low) - len(spiking), len(low)),
        "F̂: below about 20, the inhibition is too weak for a fast grating of low contrast",
    )
    return [full_contrast, all_contrasts]


def _looming(results: ExperimentResults) -> ClaimResult:
    parts, passed = list[str](), 0
    for contrast in dict.fromkeys(item.contrast for item in results.looming):
        responses = [item.response for item in results.looming if item.contrast == contrast]
        times = [response.times_above(30.0) for response in responses]
        passed += sum(len(above) > 1 for above in times)
        leads = [CONTACT - float(above[0]) for above in times if len(above)]
        lead = f", first {np.median(leads):.2f} s before contact" if leads else ""
        ffi = np.mean([response.ffi[5:60].mean() for response in responses])
        parts.append(f"contrast {contrast:g} (F̂ {ffi:.0f}): {len(leads)} of {len(responses)}{lead}")
    return ClaimResult(
        "looming in gratings: above 30 spikes/s near the end",
        "; ".join(parts),
        _grade(passed, len(results.looming)),
        "contrast of the grating: above F̂ = 10, the inhibition also suppresses the square",
    )


def _light(results: ExperimentResults) -> ClaimResult:
    parts = [
        f"on {item.background:g}: dark {item.dark:.2f}, light {item.light:.2f} s"
        for item in results.light_dark
    ]
    earlier = [item.light > item.dark + 0.04 for item in results.light_dark]
    return ClaimResult(
        "a light object causes a stronger response than a dark one",
        f"alarm before contact (60 Hz, luminance {DARK:g} and {LIGHT:g}) " + "; ".join(parts),
        _grade(sum(earlier), len(earlier)),
        "contrast to the background: the model is symmetric, 255 - L gives the same response",
    )


def _panorama(results: ExperimentResults) -> list[ClaimResult]:
    return [_approaching(results.panorama), _receding(results.panorama), _translating(results.panorama)]


def _of_shades(panorama: Mapping[str, StimulusResponse], motion: str) -> list[StimulusResponse]:
    """Return the responses to the dark and the light object of a motion."""
    return [panorama[f"{motion}, {shade}"] for shade in SHADES]


def _approaching(panorama: Mapping[str, StimulusResponse]) -> ClaimResult:
    approaching = _of_shades(panorama, "approaching")
    first_times = [
        float(above[0]) if len(above) else math.nan
        for above in (response.times_above(15.0) for response in approaching)
    ]
    leads = ", ".join(f"{CONTACT - time:.2f}" for time in first_times)
    return ClaimResult(
        "approaching in a shifting panorama: above 15 spikes/s, late",
        f"first at {leads} s before contact (dark, light); the panorama alone peaks at "
        f"{panorama['panorama alone'].peak():.0f}",
        _grade(sum(time > 0.7 * CONTACT for time in first_times), len(approaching)),
        f"F̂ of the panorama ({approaching[0].ffi[5:60].mean():.0f} here); above about 20, the inhibition "
        "suppresses every response",
    )


def _receding(panorama: Mapping[str, StimulusResponse]) -> ClaimResult:
    parts, early = list[str](), 0
    for shade, response in zip(SHADES, _of_shades(panorama, "receding"), strict=True):
        above = response.times_above(15.0)
        early += not len(above) or float(above[-1]) < 1.2
        span = f"{above[0]:.2f}–{above[-1]:.2f} s" if len(above) else "silent"
        parts.append(f"{shade} peak {response.peak():.0f} spikes/s, {span}")
    return ClaimResult(
        "receding: only at the start",
        f"{'; '.join(parts)}; the object recedes from 0.40 s on",
        _grade(early, len(SHADES)),
        "angular speed of the object, which is highest at the start",
    )


def _translating(panorama: Mapping[str, StimulusResponse]) -> ClaimResult:
    slow, fast = (_of_shades(panorama, f"passing at {speed} m/s") for speed in ("0.108", "0.3"))
    counts = [[len(response.times_above(15.0)) for response in responses] for responses in (slow, fast)]
    others = {
        model: sum(len(response.times_above(15.0, model)) for response in (*slow, *fast))
        for model in ("T_sp = 0.78", "sigma_3 = 2")
    }
    frames = sum(len(response.time) for response in (*slow, *fast))
    listed = [", ".join(map(str, numbers)) for numbers in counts]
    quiet = [not any(numbers) for numbers in counts]
    return ClaimResult(
        "translating: little or none",
        f"frames ≥ 15 spikes/s (dark, light): {listed[0]} at 0.108 m/s; {listed[1]} at 0.3 m/s; of all "
        f"{frames} frames {others['T_sp = 0.78']} with T_sp = 0.78, {others['sigma_3 = 2']} with sigma_3 = 2",
        HOLDS if all(quiet) else PARTLY if quiet[0] else FAILS,
        "speed of the edges; T_sp or sigma_3",
    )


def _ablation(results: ExperimentResults) -> ClaimResult:
    gratings = [*results.gratings, *results.low_contrast]
    silent = {model: _count_silent(gratings, model) for model in gratings[0].potential}
    high_contrast = [item.response for item in results.looming if item.contrast > 0.2]
    peaks = {
        model: np.median([response.peak(model) for response in high_contrast])
        for model in ("paper", "fixed inhibition")
    }
    better = [values["paper"] > values["fixed inhibition"] for values in (silent, peaks)]
    return ClaimResult(
        "adaptive inhibition performs better than the previous models",
        f"of {len(gratings)} gratings silent on {silent['paper']}; on {silent['fixed inhibition']} with "
        f"silencing at F̂ = 20 instead, on {silent['neither adaptation nor silencing']} with neither. "
        f"Looming in gratings of contrast ≥ 0.5, median peak: {peaks['paper']:.0f} "
        f"against {peaks['fixed inhibition']:.0f} spikes/s with silencing",
        _grade(sum(map(bool, better)), 2),
        "F̂ between 10 and 20: the adaptive model inhibits, silencing does not",
    )


def _biology(results: ExperimentResults) -> list[ClaimResult]:
    peaks = np.array([item.peak for item in results.approaches])
    slope, intercept, half_width = line_fit(np.array(L_OVER_V), peaks)
    angle = 2.0 * math.degrees(math.atan(1.0 / slope))
    n = results.selectivity["paper"]
    index = (n["approach"] - n["recede"]) / max(n["approach"] + n["recede"], 1)
    ordered = n["approach"] > n["recede"] > max(n["pass at 0.108 m/s"], n["pass at 0.3 m/s"])
    selective = index >= MIN_SELECTIVITY
    return [
        ClaimResult(
            "locust: the peak's time before contact grows linearly with l/|v|",
            f"slope {slope:.2f} ± {half_width:.2f} (locust {LOCUST_SLOPE:.1f}), i.e. a fixed angle of "
            f"{angle:.0f}° (24°); intercept {1000 * intercept:.0f} ms, not conclusive: at 30 Hz the "
            "locust's 15–35 ms cannot be resolved",
            FAILS
            if half_width > 0.2 * slope
            else HOLDS
            if abs(slope - LOCUST_SLOPE) <= half_width
            else PARTLY,
            "linear, at another angle than in the locust; sigma_3 and the adaptation of K (SFA) set it",
        ),
        ClaimResult(
            "locust: approach ≫ recede > translate",
            f"spikes {n['approach']}, {n['recede']}, {n['pass at 0.108 m/s']} and {n['pass at 0.3 m/s']} "
            f"(passing at 0.108, 0.3 m/s); index (a - r)/(a + r) {index:.2f}",
            HOLDS if ordered and selective else PARTLY if selective else FAILS,
            "speed of the passing object; without the adaptation of K (SFA), receding gives as many spikes",
        ),
    ]


def _clips(detections: Sequence[ClipDetection]) -> list[ClaimResult]:
    total = summarize_detections(detections)
    no_crash = [item for item in detections if item.crash_s is None]
    silent = [item.clip for item in no_crash if item.alarm_frames.k == 0]
    setting = PLAYBACK_CONFIGS[HEADLINE].describe()
    rows: list[ClaimResult] = []
    if total.hits.n:
        significant = total.p_value < 0.05
        rows.append(
            ClaimResult(
                "crash clips: alarm shortly before the crash, few earlier alarms",
                f"{setting}: onset in the last 1.5 s: {total.hits.k} of {total.hits.n}, by chance "
                f"{total.chance.probability:.2f} [{total.chance.low:.2f}–{total.chance.high:.2f}] each, "
                f"p = {total.p_value:.1g} at its upper bound; earlier frames in alarm "
                f"{100 * total.alarm_frames.k / max(total.alarm_frames.n, 1):.0f} %",
                HOLDS if total.hits.k == total.hits.n and significant else PARTLY if total.hits.k else FAILS,
                "T_sf relative to the frame rate, T_sp, sigma_3; texture that passes close to the camera",
            )
        )
    if no_crash:
        rows.append(
            ClaimResult(
                "near-miss clips: no alarm",
                f"{setting}: {len(silent)} of {len(no_crash)} ({', '.join(silent) or 'none'})",
                _grade(len(silent), len(no_crash)),
                "vehicles that pass close to the camera, a weakness that the paper names",
            )
        )
    return rows


def claim_table(rows: Sequence[ClaimResult]) -> Table:
    """Return the claims as a terminal table."""
    colours = {HOLDS: "green", PARTLY: "yellow", FAILS: "red"}
    title = "the paper's claims (T_sf = 30 spikes/s at 30 Hz unless stated otherwise)"
    table = Table(title=title, show_lines=True)
    for name in ("claim", "measured", "result", "depends on"):
        table.add_column(name)
    for row in rows:
        table.add_row(row.claim, row.measured, Text(row.result, colours[row.result]), row.factor)
    return table


def claims_text(rows: Sequence[ClaimResult]) -> str:
    """Return the claims as a table in Markdown."""
    return markdown_table(("claim", "measured", "result", "depends on"), rows) + "\n"


def write_claims(rows: Sequence[ClaimResult], folder: Path) -> None:
    """Write the claims to claims.csv and, as a Markdown table, to claims.md."""
    with (folder / "claims.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(ClaimResult._fields)
        writer.writerows(rows)
    (folder / "claims.md").write_text(claims_text(rows), encoding="utf-8")

"""Sections of the report of a comparison, with their tables and figures."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from lgmd_gym import neuron
from lgmd_gym.benchmark.analysis.froc import LEAD_TIME, FrocPoint
from lgmd_gym.benchmark.summary import AgentSummary
from lgmd_gym.camera import Camera
from lgmd_gym.comparison import figures
from lgmd_gym.comparison.clips import ClipResponse, ClipScore
from lgmd_gym.comparison.cost import BATCH, SHAPE, Cost
from lgmd_gym.comparison.simulation import MAIN_CAP, RULE, Operating, Pair, Worlds
from lgmd_gym.comparison.stimuli import ALARM, APPROACH, StimulusResult, selectivity
from lgmd_gym.report.document import DataTable, Figure, Section


def introduction(models: Sequence[str]) -> str:
    """Return the text before the first section."""
    lines = [f"`{name}`: {neuron.describe(neuron.base_name(name))[0]}" for name in models]
    return (
        "All models process the same frames, which are rendered or decoded once. Differences are against "
        f"`{models[0]}`.\n\n" + "\n\n".join(lines)
    )


def of_stimuli(results: Sequence[StimulusResult], folder: Path) -> Section:
    """Return the section on synthetic stimuli."""
    figures.stimulus_figure(folder / "stimuli.png", results)
    figures.approach_figure(folder / "approaches.png", results)
    names = list(dict.fromkeys(item.stimulus.name for item in results))
    peaks: list[tuple[object, ...]] = []
    for model in dict.fromkeys(item.model for item in results):
        of_model = {item.stimulus.name: item for item in results if item.model == model}
        peaks.append((model, *(of_model[name].peak for name in names)))
    leads = [
        (item.model, item.stimulus.name, item.peak, item.mean, item.lead)
        for item in results
        if item.stimulus.kind == APPROACH
    ]
    indices = [tuple(item) for item in selectivity(results)]
    caption = (
        "Index of mean responses: 1 for a response to the approach only, 0 for equal ones, negative for a "
        "weaker response to the approach, – without any. Spikes: mean spike frequency. Potential: mean of "
        "K - 0.5 where that is positive, which also measures a model below its spike threshold."
    )
    return Section(
        "Stimuli",
        "Squares that approach (l/|v| = 0.1 s unless stated), recede or pass on plain grey, in a shifting "
        "panorama and in a grating of 40 periods/m, 2 Hz and contrast 0.5, on the screen of the paper, "
        "540×270 px at 30 Hz.",
        (
            Figure("stimuli.png", f"Spike frequency of every model; grey line: {ALARM:g} spikes/s."),
            Figure("approaches.png", "Approaches of a dark square at several l/|v|: lead and peak."),
            DataTable(
                "selectivity",
                (
                    *("neuron", "spikes: approach vs recede", "spikes: approach vs pass"),
                    *("potential: approach vs recede", "potential: approach vs pass"),
                ),
                indices,
                ("", ".2f", ".2f", ".2f", ".2f"),
                caption,
            ),
            DataTable(
                "peaks",
                ("neuron", *names),
                peaks,
                ("", *(".0f" for _ in names)),
                "Highest spike frequency [spikes/s].",
            ),
            DataTable(
                "leads",
                (
                    "neuron",
                    "approach",
                    "peak [spikes/s]",
                    "mean [spikes/s]",
                    f"first {ALARM:g}/s before contact [s]",
                ),
                leads,
                hidden=True,
            ),
        ),
    )


def of_clips(
    scores: Sequence[ClipScore], responses: Sequence[ClipResponse], cap: float, folder: Path
) -> Section:
    """Return the section on video clips."""
    figures.clip_figure(folder / "clips.png", scores)
    rows: list[tuple[object, ...]] = []
    for item in scores:
        summary = item.summary
        chance = f"{summary.chance.probability:.2f} [{summary.chance.low:.2f}–{summary.chance.high:.2f}]"
        alarm = 100.0 * summary.alarm_frames.k / max(summary.alarm_frames.n, 1)
        silent = f"{summary.silent_clips.k}/{summary.silent_clips.n}"
        hits = f"{summary.hits.k}/{summary.hits.n}"
        pair = f"+{item.gained} −{item.lost}"
        rows.append(
            (item.model, hits, chance, summary.p_value, summary.lead_s, alarm, silent, pair, item.p_value)
        )
    crashes = sum(item.crash_s is not None for item in responses)
    per_clip = [
        (
            item.model,
            response.clip,
            response.fps,
            response.crash_s,
            threshold,
            detection.lead_s,
            detection.peak,
        )
        for item in scores
        for response, threshold, detection in zip(responses, item.thresholds, item.detections, strict=True)
    ]
    return Section(
        "Video clips",
        f"{len(responses)} clips, {crashes} with a crash. A crash is detected if an alarm begins in the "
        f"1.5 s before it. The threshold for a clip is the lowest at which at most {100.0 * cap:g} % of "
        "the earlier frames of all other clips are in alarm.",
        (
            Figure(
                "clips.png", "Detected crashes with 95 % interval, and the chance of an alarm in any 1.5 s."
            ),
            DataTable(
                "clips",
                (
                    *("neuron", "detected", "chance", "p against chance", "median lead [s]"),
                    *(
                        "earlier frames in alarm [%]",
                        "clips without crash or alarm",
                        "against the first",
                        "p",
                    ),
                ),
                rows,
                ("", "", "", ".2g", ".2f", ".1f", "", "", ".2g"),
                "Chance: probability that an alarm begins in any 1.5 s, from the earlier frames [95 % "
                "interval]; p against it is for its upper bound. Against the first: crashes that only this "
                "model (+) or only the first (−) detects, with McNemar's exact p, Bonferroni-corrected.",
            ),
            DataTable(
                "each_clip",
                (
                    *("neuron", "clip", "rate [Hz]", "crash [s]", "threshold [spikes/s]", "lead [s]"),
                    "peak [spikes/s]",
                ),
                per_clip,
                hidden=True,
            ),
        ),
    )


def of_simulation(
    split: str,
    worlds: Worlds,
    curves: Mapping[str, Sequence[FrocPoint]],
    chosen: Sequence[Operating],
    pairs: Sequence[Pair],
    driven: Sequence[AgentSummary],
    folder: Path,
) -> Section:
    """Return the section on simulated approaches in the worlds of a split.

    Args:
        split: Name of the split.
        worlds: The episodes.
        curves: Detection curve of each model; empty where thresholds were chosen elsewhere.
        chosen: Thresholds and results of the models.
        pairs: Differences to the first model.
        driven: Closed loop of each model.
        folder: Folder of the figures.
    """
    items: list[DataTable | Figure] = []
    if curves:
        figures.froc_figure(folder / f"froc_{split}.png", curves, LEAD_TIME)
        items.append(
            Figure(f"froc_{split}.png", "Open loop: detected threats and false alarms, by threshold.")
        )
        items.append(_curve_table(split, curves))
    figures.closed_loop_figure(folder / f"closed_loop_{split}.png", driven)
    items += [_operating_table(split, chosen), _pair_table(split, pairs)]
    items.append(
        Figure(
            f"closed_loop_{split}.png", f"Closed loop: the rule `{RULE}` at the threshold of {MAIN_CAP:g}/km."
        )
    )
    items.append(_closed_loop_table(split, driven))
    last, camera = worlds.first_world + worlds.worlds - 1, Camera.make(worlds.camera).name
    threats, distance = chosen[0].point.detected.n, chosen[0].point.distance / 1000.0
    choice = (
        "They choose the threshold of each model: that with the most detections under a cap of false alarms."
        if curves
        else "The thresholds are those of the validation worlds; nothing was chosen here."
    )
    return Section(
        f"Simulation, {split} worlds",
        f"Suites {', '.join(worlds.suites)} with {worlds.seeds} seeds in worlds {worlds.first_world} to "
        f"{last} and their weather, through the camera `{camera}`: {threats} threats, "
        f"{distance:.1f} km in which an alarm is false. A threat is detected by an alarm that begins 4 to "
        f"{LEAD_TIME:g} s before contact without braking. {choice}",
        tuple(items),
    )


def _curve_table(split: str, curves: Mapping[str, Sequence[FrocPoint]]) -> DataTable:
    rows = [
        (
            model,
            point.threshold,
            point.detected.k,
            point.detected.n,
            point.false_alarms,
            point.false_per_km,
            point.chance,
        )
        for model, points in curves.items()
        for point in points
    ]
    columns = ("neuron", "threshold", "detected", "threats", "false alarms", "false per km", "chance")
    return DataTable(f"froc_{split}", columns, rows, hidden=True)


def _operating_table(split: str, chosen: Sequence[Operating]) -> DataTable:
    rows: list[tuple[object, ...]] = []
    for item in chosen:
        rate = item.point.detected
        detected = f"{rate.k}/{rate.n} ({100 * rate.low:.0f}–{100 * rate.high:.0f} %)"
        false = f"{item.point.false_per_km:.2f} [{item.point.false_low:.2f}–{item.point.false_high:.2f}]"
        rows.append((item.cap, item.model, item.threshold, detected, false, 100.0 * item.point.chance))
    rows.sort(key=lambda row: row[0])  # pyright: ignore[reportArgumentType, reportCallIssue, reportUnknownLambdaType]
    return DataTable(
        f"thresholds_{split}",
        ("cap [1/km]", "neuron", "threshold [spikes/s]", "detected", "false alarms per km", "chance [%]"),
        rows,
        (".2g", "", ".0f", "", "", ".1f"),
        "Detected: interval clustered by case and world. False alarms: exact Poisson interval. Chance: "
        "share of random windows as long as that of a detection in which an alarm begins.",
    )


def _pair_table(split: str, pairs: Sequence[Pair]) -> DataTable:
    rows = [
        (
            *(item.cap, item.model, f"+{item.gained} −{item.lost}"),
            *(_percent(value) for value in item.difference[:3]),
            *(item.p_value, item.p_adjusted),
        )
        for item in pairs
    ]
    return DataTable(
        f"pairs_{split}",
        ("cap [1/km]", "neuron", "against the first", "difference [%]", "low", "high", "p", "p corrected"),
        rows,
        (".2g", "", "", ".1f", ".1f", ".1f", ".2g", ".2g"),
        "Threats that only this model (+) or only the first (−) detects, each at its own threshold; "
        "difference of shares with a 95 % bootstrap interval over cases and worlds; McNemar's exact p, "
        "which takes threats as independent, and Bonferroni-corrected for the models of the same cap.",
    )


def _closed_loop_table(split: str, driven: Sequence[AgentSummary]) -> DataTable:
    rows: list[tuple[object, ...]] = []
    for item in driven:
        rates = item.avoided, item.premature, item.false_activations
        texts = [f"{rate.k}/{rate.n} ({100 * rate.low:.0f}–{100 * rate.high:.0f} %)" for rate in rates]
        reduction = _percent(item.speed_reduction.value, 3.6)
        rows.append((item.agent, *texts, reduction, item.ttc_at_brake))
    return DataTable(
        f"closed_loop_{split}",
        (
            *("neuron", "avoided", "premature", "false activations", "speed reduction [km/h]"),
            "median time to contact at braking [s]",
        ),
        rows,
        ("", "", "", "", ".1f", ".2f"),
        "Avoided: threats without contact and without braking more than 4 s before it. Intervals are "
        "clustered by case and world.",
    )


def of_cost(costs: Sequence[Cost]) -> Section:
    """Return the section on time and memory."""
    rows = [
        (item.model, item.single_us, item.batch_us, item.state_bytes / 1024.0, item.bytes_per_px)
        for item in costs
    ]
    return Section(
        "Cost",
        f"One core, frames of {SHAPE[1]}×{SHAPE[0]} px, the fastest of several rounds.",
        (
            DataTable(
                "cost",
                ("neuron", "µs per frame", f"µs per frame of {BATCH}", "state [KiB]", "state [bytes/px]"),
                rows,
                ("", ".0f", ".0f", ".0f", ".1f"),
                f"One neuron at a time, and {BATCH} in one call. State: all arrays of one neuron.",
            ),
        ),
    )


def _percent(value: float | None, scale: float = 100.0) -> float:
    return math.nan if value is None else scale * value

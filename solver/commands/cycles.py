"""What ``markerscope cycles`` does: trials of one person to mean curves, figures of each cycle, scores and a figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver import __version__
from markerscope.solver.commands.events import repetitions_of
from markerscope.solver.commands.trial import Found, Trial, events_of_rows, events_of_trial, load_trial
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.plain import json_text
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.request import Outcome
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.cycles.curve import Curve, CutCurve, Scalar, cut_all, peaks_of, symmetry
from markerscope.solver.cycles.cycle import Cycle, gait_cycles, judged, left_out, repetition_cycles
from markerscope.solver.cycles.gait import gait_curves, progression
from markerscope.solver.cycles.request import CyclesRequest, FilterRequest, name_of
from markerscope.solver.cycles.scores import Band, Profile, band_for, bands_of, profile_of, z_scores
from markerscope.solver.cycles.steps import DEFINITIONS, step_table
from markerscope.solver.figures.gait_page import gait_page
from markerscope.solver.figures.pdf import pdf
from markerscope.solver.figures.svg import svg
from markerscope.solver.filters.smooth import Filter, residual_analysis, smooth
from markerscope.solver.io.angles_in import AngleTable, read_angles
from markerscope.solver.io.atomic import write_bytes_atomic, write_text_atomic
from markerscope.solver.io.cycles_csv import CURVES, MEANS, SCALARS, read_bands, table
from markerscope.solver.io.events_csv import FILE_NAME, read_events_csv
from markerscope.solver.io.output_folder import check_output_folder
from markerscope.solver.io.together import together

FOLDER = "cycles"
_TABLES = (".mot", ".sto")


@dataclass(frozen=True, eq=False)
class _Read:
    """One trial, ready to be cut."""

    name: str
    curves: tuple[Curve, ...]
    cycles: tuple[Cycle, ...]
    steps: tuple[Scalar, ...]
    told_by: str
    way: str
    filter: Filter
    notes: tuple[str, ...]


def make_cycles(request: CyclesRequest, progress: Progress = silent) -> Outcome:
    """Read, cut, average, compare with controls, write.

    Raises
    ------
    InputError : a trial, its events or the controls cannot be used, or the folder cannot be written
    """
    out = request.out if request.out is not None else _own_folder(request.trials[0])
    check_output_folder(out)
    reasons = dict(request.leave_out)
    trials = []
    every = (*request.trials, *(() if _one_csv(request.controls) else request.controls))
    for i, path in enumerate(request.trials):
        progress(0.9 * i / len(every), f"reading {name_of(path)}")
        trials.append(_read(path, request, _reasons_for(name_of(path), reasons, request)))
    cut = cut_all([(trial.name, trial.curves, trial.cycles) for trial in trials])
    bands = _controls(request, len(request.trials), len(every), progress)
    if not cut:
        raise InputError(_nothing(trials), str(request.trials[0]), "record more, or see markerscope events")
    progress(0.92, "writing")
    scalars = [*(row for trial in trials for row in trial.steps), *(row for curve in cut for row in peaks_of(curve))]
    profile = profile_of(cut, bands) if bands else None
    about = _about(request, trials, cut, bands, profile, scalars)
    with together(out) as folder:
        write_text_atomic(folder / "mean.csv", table(MEANS, _mean_rows(cut, _filters(trials))))
        write_text_atomic(folder / "cycles.csv", table(CURVES, _curve_rows(cut)))
        write_text_atomic(folder / "figures.csv", table(SCALARS, (asdict(row).values() for row in scalars)))
        title = request.title or ", ".join(trial.name for trial in trials)
        page = gait_page(cut, title, bands, width_mm=request.width_mm, note=_note(trials))
        if any(curve.name == "knee_flexion" for curve in cut):
            write_text_atomic(folder / "gait.svg", svg(page))
            write_bytes_atomic(folder / "gait.pdf", pdf(page))
        if bands:
            write_text_atomic(folder / "controls.csv", table(("quantity", "side", "percent", "z"), _z_rows(cut, bands)))
        write_text_atomic(folder / "cycles.json", json_text(about) + "\n")
        files = sorted(path.name for path in folder.iterdir())
    return Outcome(
        summary={"out": str(out), "files": files, **about},
        lines=(*_lines(trials, scalars, profile), f"Written to {out}: {', '.join(files)}."),
    )


def _own_folder(path: Path) -> Path:
    if path.suffix.lower() in _TABLES:
        raise InputError("no folder was named for the cycles of an angle table", path, "add --out DIR")
    return (path if path.is_dir() else path.parent) / FOLDER


def _one_csv(controls: Sequence[Path]) -> bool:
    return len(controls) == 1 and controls[0].suffix.lower() == ".csv"


def _reasons_for(name: str, reasons: Mapping[str, str], request: CyclesRequest) -> dict[str, str]:
    """What is left out of one trial, by the cycle's name."""
    names = {name_of(path) for path in request.trials}
    own = {}
    for which, reason in reasons.items():
        trial, slash, cycle = which.rpartition("/")
        if slash and trial not in names:
            raise InputError(
                f"there is no trial {trial!r}", "--leave-out", f"the trials are {', '.join(sorted(names))}"
            )
        if not slash and len(names) > 1:
            raise InputError(f"{which!r} says not of which trial", "--leave-out", f'say "TRIAL/{which}: why"')
        if not slash or trial == name:
            own[cycle] = reason
    return own


def _read(path: Path, request: CyclesRequest, reasons: Mapping[str, str]) -> _Read:
    if path.suffix.lower() in _TABLES:
        return _read_table(path, request, reasons)
    trial = load_trial(path)
    if trial.body is None or trial.turn is None:
        raise InputError("is a marker file, whose joint angles are not known", path, "solve it first")
    angles = read_angles(path if path.is_dir() else path.parent)
    found = _events(trial, request)
    feet = trial.feet
    assert feet is not None
    ahead, way = progression(feet)
    body = trial.body
    curves: list[Curve] = []
    if "gait" in request.quantities:
        landmarks, rest = body.body.landmarks(body.betas), body.body.joints(body.betas)
        curves += gait_curves(trial.time, trial.turn, landmarks, rest, ahead)
    own = _of_table(angles)
    if "angles" in request.quantities:
        curves += own
    how = _filter(request.filter, [curve for curve in (curves or own) if curve.unit == "degrees"])
    curves = [_smoothed(curve, how) for curve in curves]
    if "velocities" in request.quantities:
        curves += [_smoothed(curve, how).velocity for curve in own]
    if "joints" in request.quantities:
        curves += _smoothed_points("joint", JOINTS, trial.time, body.joints, how)
    if "markers" in request.quantities and trial.markers is not None:
        curves += _smoothed_points("marker", trial.markers.labels, trial.markers.time, trial.markers.positions, how)
    known = np.stack([np.isfinite(curve.values) for curve in curves if len(curve.values) == len(trial.time)], axis=1)
    cycles = _cycles(found, request, reasons, path, trial.time, known)
    steps = () if request.repetitions else step_table(trial.name, feet, cycles, ahead)
    return _Read(trial.name, tuple(curves), cycles, steps, found.told_by, way, how, (*trial.notes, *found.notes))


def _read_table(path: Path, request: CyclesRequest, reasons: Mapping[str, str]) -> _Read:
    if request.events is None and request.repetitions is None:
        raise InputError("is an angle table, which holds no events", path, "add --events FILE or --repetitions ANGLE")
    angles = read_angles(path)
    found = repetitions_of(path, request.repetitions) if request.repetitions else _given(request.events, path)
    own = _of_table(angles)
    how = _filter(request.filter, own)
    curves = [_smoothed(curve, how) for curve in own]
    if "velocities" in request.quantities:
        curves += [curve.velocity for curve in curves]
    cycles = _cycles(found, request, reasons, path, angles.time, np.isfinite(angles.degrees))
    return _Read(name_of(path), tuple(curves), cycles, (), found.told_by, "", how, found.notes)


def _events(trial: Trial, request: CyclesRequest) -> Found:
    """Those given, those beside the result, else those that are found."""
    folder = trial.path if trial.path.is_dir() else trial.path.parent
    if request.repetitions is not None:
        return repetitions_of(folder, request.repetitions)
    if request.events is not None:
        return _given(request.events, trial.path)
    if (folder / FILE_NAME).is_file():
        found = _given(folder / FILE_NAME, trial.path)
        if gait_cycles(found.events):
            return found
    return events_of_trial(trial)


def _given(path: Path | None, where: Path) -> Found:
    if path is None or not path.is_file():
        raise InputError("there is no such file", path or where, "check the name (--events)")
    events = events_of_rows(read_events_csv(path), str(path))
    return Found(events, path.name, False, ())


def _cycles(
    found: Found, request: CyclesRequest, reasons: Mapping[str, str], path: Path, time: np.ndarray, known: np.ndarray
) -> tuple[Cycle, ...]:
    cycles = repetition_cycles(found.events) if request.repetitions else gait_cycles(found.events)
    return left_out(judged(cycles, time, known), reasons, f"--leave-out, {path}")


def _of_table(angles: AngleTable) -> list[Curve]:
    """Its columns, left and right told apart by their names; the convention before them, where it is known."""
    curves = []
    convention = angles.about.get("convention")
    for i, column in enumerate(angles.names):
        name, side = _name_and_side(column, angles.names)
        positive = angles.positive.get(column, "")
        name = f"{convention}/{name}" if convention else name
        curves.append(Curve(name, side, "degrees", angles.time, angles.degrees[:, i], column, positive))
    return curves


def _name_and_side(column: str, names: Sequence[str]) -> tuple[str, str]:
    for end, side in (("_r", "right"), ("_l", "left")):
        if column.endswith(end):
            return column[:-2], side
    for start, other, side in (("R", "L", "right"), ("L", "R", "left")):
        if column.startswith(start) and other + column[1:] in names:
            return column[1:], side
    return column, ""


def _filter(asked: FilterRequest, curves: Sequence[Curve]) -> Filter:
    """The filter that was asked for, its cut-off chosen by residual analysis of all angles where it says so."""
    if asked.kind != "butterworth" or asked.cutoff is not None:
        return Filter(asked.kind, asked.order, asked.cutoff or Filter().cutoff)
    rate = _rate(curves[0].time)
    values = np.stack([curve.values for curve in curves], axis=1)
    moving = np.nanstd(values, axis=0) > 1.0
    if not moving.any():
        raise InputError("nothing moves, so that no cut-off can be chosen", "--filter", "give it in Hz")
    return Filter("butterworth", asked.order, round(residual_analysis(values[:, moving], rate, asked.order).cutoff, 1))


def _rate(time: np.ndarray) -> float:
    return (len(time) - 1) / float(time[-1] - time[0])


def _smoothed(curve: Curve, how: Filter) -> Curve:
    values = smooth(curve.values, _rate(curve.time), how)
    return Curve(curve.name, curve.side, curve.unit, curve.time, values, curve.column, curve.positive)


def _smoothed_points(what: str, names: Sequence[str], time: np.ndarray, points: np.ndarray, how: Filter) -> list[Curve]:
    smoothed = smooth(points, _rate(time), how)
    return [
        Curve(f"{what} {name} {axis}", "", "m", time, smoothed[:, i, k])
        for i, name in enumerate(names)
        for k, axis in enumerate("xyz")
    ]


def _controls(request: CyclesRequest, done: int, total: int, progress: Progress) -> dict[tuple[str, str], Band]:
    if not request.controls:
        return {}
    if _one_csv(request.controls):
        curves = read_bands(request.controls[0])
        percent = np.linspace(0, 100, 101)
        return {
            key: Band(*(np.interp(percent, np.linspace(0, 100, len(v)), v) for v in pair))
            for key, pair in curves.items()
        }
    if any(path.suffix.lower() == ".csv" for path in request.controls):
        raise InputError("a CSV of mean and SD stands alone", "--controls", "give one CSV, or results")
    plain = CyclesRequest(request.controls, out=Path("."), quantities=request.quantities, filter=request.filter)
    read = []
    for i, path in enumerate(request.controls):
        progress(0.9 * (done + i) / total, f"reading {name_of(path)}")
        read.append(_read(path, plain, {}))
    cut = cut_all([(trial.name, trial.curves, trial.cycles) for trial in read])
    return bands_of(cut, {trial.name: trial.name for trial in read})


def _nothing(trials: Sequence[_Read]) -> str:
    why = [
        f"{trial.name} {cycle.name}: {cycle.why_not}" for trial in trials for cycle in trial.cycles if not cycle.used
    ]
    return f"every cycle was left out ({'; '.join(why[:4])})" if why else "holds no whole cycle"


def _mean_rows(cut: Sequence[CutCurve], filtered: str) -> list[list[object]]:
    rows: list[list[object]] = []
    for c in cut:
        s = c.summary
        columns = (s.count, s.mean, s.sd, s.median, s.p5, s.p25, s.p75, s.p95)
        rows += [
            [c.name, c.side, c.unit, k, int(s.count[k]), *(v[k] for v in columns[1:]), filtered] for k in range(101)
        ]
    return rows


def _curve_rows(cut: Sequence[CutCurve]) -> list[list[object]]:
    return [
        [trial, cycle.name, c.name, c.side, c.unit, k, values[k]]
        for c in cut
        for values, trial, cycle in zip(c.values, c.trials, c.cycles)
        for k in range(101)
    ]


def _z_rows(cut: Sequence[CutCurve], bands: Mapping[tuple[str, str], Band]) -> list[list[object]]:
    rows: list[list[object]] = []
    for c in cut:
        band = band_for(bands, c.name, c.side)
        if band is not None:
            rows += [[c.name, c.side, k, value] for k, value in enumerate(z_scores(c.summary, band))]
    return rows


def _note(trials: Sequence[_Read]) -> str:
    out = sum(not cycle.used for trial in trials for cycle in trial.cycles)
    said = f"Mean and SD of the cycles, degrees. {_filters(trials).capitalize()}."
    return f"{said} {out} cycle{'' if out == 1 else 's'} left out." if out else said


def _filters(trials: Sequence[_Read]) -> str:
    """The filter, or filters where each trial chose its own cut-off."""
    return "; ".join(dict.fromkeys(trial.filter.words for trial in trials))


def _about(
    request: CyclesRequest,
    trials: Sequence[_Read],
    cut: Sequence[CutCurve],
    bands: Mapping[tuple[str, str], Band],
    profile: Profile | None,
    scalars: Sequence[Scalar],
) -> dict[str, Any]:
    return {
        "program": f"markerscope {__version__}",
        "filter": _filters(trials),
        "trials": [
            {
                "trial": trial.name,
                "events": trial.told_by,
                "progression": trial.way,
                "filter": trial.filter.words,
                "cycles_used": [cycle.name for cycle in trial.cycles if cycle.used],
                "left_out": [{"cycle": c.name, "why": c.why_not} for c in trial.cycles if not c.used],
                "notes": list(trial.notes),
            }
            for trial in trials
        ],
        "steps": _table_of(scalars),
        "definitions": {name: {"unit": unit, "is": text} for name, (unit, text) in DEFINITIONS.items()},
        "quantities": [
            {"quantity": c.name, "side": c.side, "unit": c.unit, "cycles": len(c.values), "positive": c.positive}
            for c in cut
        ],
        "controls": None
        if profile is None
        else {
            "from": [path.name for path in request.controls],
            "people": max((band.count for band in bands.values()), default=0),
            "gait_variable_scores": [
                {"quantity": name, "side": side, "degrees": value} for (name, side), value in profile.variables.items()
            ],
            "gait_profile_score": {"left": profile.left, "right": profile.right, "both": profile.both},
            "missing": list(profile.missing),
        },
    }


def _table_of(scalars: Sequence[Scalar]) -> list[dict[str, Any]]:
    """Mean and SD of each figure on each side, and the symmetry index of the means."""
    gathered: dict[tuple[str, str], dict[str, list[float]]] = {}
    for scalar in scalars:
        by_side = gathered.setdefault((scalar.quantity, scalar.unit), {})
        if np.isfinite(scalar.value):
            by_side.setdefault(scalar.side, []).append(scalar.value)
    rows = []
    for (quantity, unit), by_side in gathered.items():
        sides = {
            side: {
                "mean": float(np.mean(own)),
                "sd": float(np.std(own, ddof=1)) if len(own) > 1 else np.nan,
                "n": len(own),
            }
            for side, own in by_side.items()
        }
        row: dict[str, Any] = {"quantity": quantity, "unit": unit, **sides}
        if {"left", "right"} <= set(sides) and "time of" not in quantity:
            row["symmetry_index_percent"] = symmetry(sides["left"]["mean"], sides["right"]["mean"])
        rows.append(row)
    return rows


def _lines(trials: Sequence[_Read], scalars: Sequence[Scalar], profile: Profile | None) -> list[str]:
    lines = []
    for trial in trials:
        used = {
            side: sum(c.used and c.side == side for c in trial.cycles)
            for side in dict.fromkeys(c.side for c in trial.cycles)
        }
        counted = ", ".join(f"{n} {side}" for side, n in used.items()) or "none"
        lines.append(f"{trial.name}: cycles {counted}; events told by {trial.told_by}.")
        lines += [f"  left out: {c.name}, {c.why_not}." for c in trial.cycles if not c.used]
        lines += [f"  Note: {note}" for note in trial.notes]
    lines.append(f"Filter: {_filters(trials)}.")
    rows = [row for row in _table_of(scalars) if row["quantity"] in DEFINITIONS]
    if rows:
        lines.append(f"  {'':18}{'left':>16}{'right':>16}")
    for row in rows:
        cells = [_mean_sd(row.get(side)) for side in ("left", "right")]
        lines.append(f"  {row['quantity']:18}{cells[0]:>16}{cells[1]:>16}  {row['unit']}")
    if profile is not None:
        said = ", ".join(
            f"{name} {value:.1f}"
            for name, value in (("left", profile.left), ("right", profile.right), ("both", profile.both))
            if np.isfinite(value)
        )
        lines.append(f"Gait profile score, degrees: {said or 'not known'}.")
        if profile.missing:
            lines.append(
                f"  Missing for it: {'; '.join(profile.missing[:6])}{'...' if len(profile.missing) > 6 else ''}."
            )
    return lines


def _mean_sd(figure: Mapping[str, float] | None) -> str:
    if figure is None:
        return "-"
    sd = f" ({figure['sd']:.2f})" if np.isfinite(figure["sd"]) else ""
    return f"{figure['mean']:.2f}{sd}"

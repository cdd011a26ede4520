"""Whether the standard errors of joint angles cover the errors that they speak of, on sessions of known truth.

    python -m benchmarks.error_bars draw FOLDER --first 0 --count 60
    python -m benchmarks.error_bars calibrate FOLDER
    python -m benchmarks.error_bars judge FOLDER
    python -m benchmarks.error_bars real DATA

``draw`` makes sessions, solves them and leaves errors and standard errors in FOLDER; a session that is there is not
drawn again. ``calibrate`` prints the factors that make them cover what they should; ``judge`` prints Markdown tables.
Calibrate on other numbers than are judged. Angles of truth and solution are read off by one convention, so the spread
of definitions does not enter and is taken out of the standard errors.
``real`` solves the recording of ``benchmarks.squat`` as it is and from the pose of its first second, and compares with
the inverse kinematics of its labelled markers, which have errors of their own.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.squat import PARTS, stripped
from benchmarks.trap_sessions import FRAMES, movements
from markerscope.solver.angles.angles import AngleSettings, evidence, joint_angles
from markerscope.solver.bench.measure import heading_error_deg, right_part
from markerscope.solver.bench.motions import read_source
from markerscope.solver.body.bones import load_body
from markerscope.solver.commands import solve_session
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import silent
from markerscope.solver.core.request import SolveRequest
from markerscope.solver.fit import method
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.observe import observe
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.fit.settings import FitSettings, LocalizeSettings, OrientSettings
from markerscope.solver.fit.standard_errors.calibrated import USUAL_MARKER_MM, USUAL_VIDEO_DEG, factors
from markerscope.solver.fit.standard_errors.propagate import standard_errors
from markerscope.solver.fit.state import Observations
from markerscope.solver.io.export_trc import write_trc
from markerscope.solver.io.mot import read_mot
from markerscope.solver.synth.session import SynthSession, synthesise
from markerscope.solver.synth.settings import Layout, SynthSettings

GROUPS = ("full body", "part of the body", "video x3", "soft tissue x3", "other bodies")
GROUNDS = ("markers", "one segment", "video only")
_PARTS = ("left_leg", "right_leg", "left_arm", "right_arm")
_LAYOUTS: tuple[Layout, ...] = ("plug_in_gait", "ior", "cast", "uniform")
_EVERY = 5
_LARGE_DEG = 8.0


def drawn(number: int) -> tuple[str, SynthSession]:
    """The group and the session of a number; the groups take turns."""
    group, turn = GROUPS[number % len(GROUPS)], number // len(GROUPS)
    sources = movements(None)
    usual = SynthSettings(frames=FRAMES, markers=(40, 25)[turn % 2], lost=0.04)
    settings = {
        "full body": usual,
        "part of the body": replace(usual, markers=10, part=_PARTS[turn % len(_PARTS)]),
        "video x3": replace(usual, video_noise=3.0),
        "soft tissue x3": replace(usual, slide=3.0),
        "other bodies": replace(
            usual, spread=1.2, bones=0.06, bumps=0.015, centres_mm=8.0, slide=2.0, layout=_LAYOUTS[turn % 4]
        ),
    }[group]
    return group, synthesise(read_source(sources[number * 7 % len(sources)]), settings, 50_000 + number)


@dataclass(frozen=True, eq=False)
class Fitted:
    """A session, its group, what the fit used of it, and the fit."""

    group: str
    session: SynthSession
    used: Observations
    points: Points
    motion: FittedMotion


def fitted(number: int) -> Fitted:
    """The session of a number, solved."""
    group, session = drawn(number)
    body, truth = load_body(), session.truth
    seen, points = observe(session.markers, session.prior, None, body, truth.offset, 1.0)
    left_out = np.zeros(len(session.markers.labels), bool)
    found = method.localize(body, seen, left_out, LocalizeSettings())
    ranked = method.orient(body, seen, points, found, OrientSettings())
    motion = method.fit(body, seen, points, found, ranked, session.markers.time, FitSettings())
    return Fitted(group, session, method.in_use(seen, found, ranked), points, motion)


def errors_and_bars(fit: Fitted) -> dict[str, Any]:
    """Errors and standard errors of a session's angles, these before they are multiplied, every fifth frame."""
    session, motion, body, settings = fit.session, fit.motion, load_body(), AngleSettings()
    truth = session.truth
    ours = joint_angles(
        motion.time, motion.rotations, body.landmarks(motion.betas), body.joints(motion.betas), settings
    )
    theirs = joint_angles(
        motion.time,
        truth.motion.rotations,
        truth.body.landmarks(truth.betas),
        truth.body.joints(truth.betas),
        settings,
    )
    singular = ours.singular | theirs.singular
    bars = standard_errors(body, fit.used, fit.points, motion, settings, singular=singular)
    level = np.sqrt(np.maximum(bars.level**2 - bars.definition**2, 0))
    right = right_part(motion.marker_joint, truth.marker_joint, session.settings.part)
    right &= heading_error_deg(motion.rotations[:, 0], truth.motion.rotations[:, 0]) < 45
    grounds = evidence(settings.convention, motion.marker_joint)
    factor = np.array([factors(grounds[name], bars.video_deg, bars.marker_mm) for name in ours.names])
    return {
        "about": json.dumps(
            {"group": fit.group, "right": bool(right), "video": bars.video_deg, "marker": bars.marker_mm}
        ),
        "names": np.array(ours.names),
        "grounds": np.array([grounds[name] for name in ours.names]),
        "error": (((ours.degrees - theirs.degrees + 180) % 360) - 180)[::_EVERY].astype(np.float32),
        "shape": (bars.shape / factor[:, 0])[::_EVERY].astype(np.float32),
        "level": (level / factor[:, 1])[::_EVERY].astype(np.float32),
    }


def draw(folder: Path, first: int, count: int) -> None:
    """Solve sessions whose results are not there yet."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(first, first + count):
        path = folder / f"{number:05d}.npz"
        if path.exists():
            continue
        try:
            np.savez_compressed(path, **errors_and_bars(fitted(number)))
        except InputError as error:
            print(f"{number}: {error}", file=sys.stderr)
        print(f"{number} done", flush=True)


def curves(folder: Path, *, raw: bool = False) -> list[dict[str, Any]]:
    """Every curve of the sessions solved on the right part and the right way round; ``raw``: before calibration."""
    found = []
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as data:
            about = json.loads(str(data["about"]))
            if not about["right"]:
                continue
            for i, ground in enumerate(data["grounds"]):
                known = np.isfinite(data["shape"][:, i])
                if known.sum() < 10:
                    continue
                times = (1.0, 1.0) if raw else factors(str(ground), about["video"], about["marker"])
                row = {"ground": str(ground), "name": str(data["names"][i]), **about}
                for name, factor in zip(("error", "shape", "level"), (1.0, *times)):
                    row[name] = data[name][known, i].astype(float) * factor
                found.append(row)
    return found


def calibrate(folder: Path) -> None:
    """Print the powers of the noise by which errors grow beyond the linear theory, and then the factors.

    Powers: least squares of the logarithm of each curve's error over its standard error. Factors: of shape, where the
    spread about the mean is as said; of level, where 68.5 % of the frames are covered.
    """
    rows = curves(folder, raw=True)
    noise = np.log([[row["video"] / USUAL_VIDEO_DEG, row["marker"] / USUAL_MARKER_MM] for row in rows])
    grounds = np.array([[row["ground"] == ground for ground in GROUNDS] for row in rows], float)
    off = [np.sqrt((row["error"] ** 2).mean() / (row["shape"] ** 2 + row["level"] ** 2).mean()) for row in rows]
    powers = np.linalg.lstsq(np.concatenate([noise, grounds], axis=1), np.log(off), rcond=None)[0][:2]
    powers = np.maximum(powers, 0)
    print(f"powers: ({powers[0]:.2f}, {powers[1]:.2f})")
    for row, times in zip(rows, np.exp(noise @ powers)):
        row["shape"], row["level"] = row["shape"] * times, row["level"] * times
    for ground in GROUNDS:
        mine = [row for row in rows if row["ground"] == ground]
        shape = float(np.quantile([row["error"].std() / np.sqrt((row["shape"] ** 2).mean()) for row in mine], 0.6))
        low, high = 0.05, 8.0
        for _ in range(30):
            factor = np.sqrt(low * high)
            inside = np.mean([covered(row, 1.0, shape, factor) for row in mine])
            low, high = (factor, high) if inside < 0.685 else (low, factor)
        print(f"{ground}: ({shape:.2f}, {factor:.2f}) from {len(mine)} curves")


def covered(row: dict[str, Any], times: float, shape: float = 1.0, level: float = 1.0) -> float:
    """Share of the frames of a curve within so many standard errors."""
    return float((np.abs(row["error"]) <= times * np.hypot(shape * row["shape"], level * row["level"])).mean())


def judge(folder: Path) -> None:
    """Print coverage by group, and how well the standard errors tell large errors from small ones."""
    rows = curves(folder)
    files = list(folder.glob("*.npz"))
    print(
        f"{len(files)} synthetic sessions, {len(rows)} curves of those solved on the right part the right way round.\n"
    )
    print("| group | curves | within 1 | within 2 | AUC, error over 8 degrees | rank correlation |")
    print("|---|---|---|---|---|---|")
    for kind, names in (("group", GROUPS), ("ground", GROUNDS), (None, ("all",))):
        for name in names:
            mine = [row for row in rows if kind is None or row[kind] == name]
            if mine:
                print(_line(name, mine), flush=True)


def _line(name: str, rows: list[dict[str, Any]]) -> str:
    from scipy.stats import spearmanr

    once, twice = (100 * np.mean([covered(row, times) for row in rows]) for times in (1.0, 2.0))
    error = np.array([np.sqrt((row["error"] ** 2).mean()) for row in rows])
    bar = np.array([np.sqrt((row["shape"] ** 2 + row["level"] ** 2).mean()) for row in rows])
    large = error > _LARGE_DEG
    auc = "-"
    if 3 <= large.sum() <= len(large) - 3:
        more = bar[large][:, None] - bar[~large]
        auc = f"{float((more > 0).mean() + (more == 0).mean() / 2):.2f}"
    rank = f"{float(spearmanr(error, bar).statistic):.2f}" if len(rows) > 5 else "-"
    return f"| {name} | {len(rows)} | {once:.0f} % | {twice:.0f} % | {auc} | {rank} |"


def real(data: Path) -> None:
    """Print how often the angles of a real recording lie within their standard errors of a reference."""
    print("| real recording | rests on | angles | within 1 | within 2 |\n|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for part in PARTS:
            path = Path(folder) / f"{part}.trc"
            write_trc(path, stripped(data, part, 1)[0])
            for name, span in (("as recorded", None), ("from the first second", (0.0, 1.0))):
                out = Path(folder) / part / name
                request = SolveRequest(
                    path, video=data / "squat_video" / "video.mp4", out=out, neutral=span, standard_errors=True
                )
                solve_session(request, silent)
                table = np.genfromtxt(out / "angles.csv", delimiter=",", names=True)
                about = {row["column"]: row for row in json.loads((out / "angles.json").read_text())["angles"]}
                reference = read_mot(data / "squat_video" / "squats1_ik.mot")
                true = reference.in_degrees()
                for ground in GROUNDS:
                    inside = []
                    for angle in (a for a in about if a in true and about[a]["evidence"] == ground):
                        theirs = np.interp(table["time"], reference.time, true[angle])
                        if span is not None:
                            theirs = theirs - theirs[table["time"] - table["time"][0] <= span[1]].mean()
                        if angle.startswith("pelvis"):
                            continue  # the reference's lab is turned
                        off = np.abs(table[angle] - theirs) / table[f"{angle}_se"]
                        inside.append([np.nanmean(off <= times) for times in (1.0, 2.0)])
                    if inside:
                        once, twice = 100 * np.mean(inside, axis=0)
                        print(
                            f"| {part.replace('_', ' ')}, {name} | {ground} | {len(inside)} | {once:.0f} % "
                            f"| {twice:.0f} % |",
                            flush=True,
                        )


def main() -> int:
    """Do what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("draw", "calibrate", "judge", "real"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--first", type=int, default=0, help="number of the first session to draw")
    parser.add_argument("--count", type=int, default=50)
    options = parser.parse_args()
    if options.what == "draw":
        draw(options.folder, options.first, options.count)
    else:
        {"calibrate": calibrate, "judge": judge, "real": real}[options.what](options.folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())

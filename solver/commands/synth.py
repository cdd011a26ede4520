"""What ``markerscope synth`` does: a motion and settings to a folder of files."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.request import Outcome, SynthRequest
from markerscope.solver.io.output_folder import check_output_folder
from markerscope.solver.synth.files import FILES, MARKERS, PRIOR, REFERENCE, check_free, write_session
from markerscope.solver.synth.session import SynthSession, SynthSettings, synthesise
from markerscope.solver.synth.source import read_source


def make_session(request: SynthRequest, progress: Progress = silent) -> Outcome:
    """Draw a session and write its files.

    Raises
    ------
    InputError : the motion cannot be read, the settings cannot be met, or the folder cannot be written
    """
    if request.seed < 0:
        raise InputError(f"{request.seed} is not possible", "--seed", "give 0 or a positive whole number")
    settings = SynthSettings(**request.settings)
    check_free(request.out)
    check_output_folder(request.out)
    progress(0.0, "reading the motion")
    motion = read_source(request.motion, skeleton=request.skeleton, rate=request.motion_rate)
    progress(0.2, "drawing the session")
    session = synthesise(motion, settings, request.seed)
    progress(0.8, "writing")
    write_session(request.out, session)
    out = request.out
    lines = (
        *_described(session),
        f"Written to {out}: {', '.join(FILES)}.",
        f"Solve it with: markerscope solve {out / MARKERS} --prior {out / PRIOR} --out RESULT",
        f"Judge the result with: markerscope evaluate RESULT {out / REFERENCE}",
    )
    return Outcome(summary=_summary(session), lines=lines)


def _summary(session: SynthSession) -> dict[str, object]:
    truth, markers = session.truth, session.markers
    real = truth.marker_joint >= 0
    return {
        "motion": session.motion,
        "seed": session.seed,
        "frames": len(markers.positions),
        "rate": markers.rate,
        "markers": int(real.sum()),
        "ghosts": int((~real).sum()),
        "lost": float(1 - markers.present[:, real].mean()),
        "swaps": len(truth.swaps),
        "tracked": float(np.mean(session.prior.tracked)),
        "true_offset": truth.offset,
    }


def _described(session: SynthSession) -> tuple[str, ...]:
    about = _summary(session)
    seconds = len(session.markers.positions) / session.markers.rate
    lines = [
        f"{seconds:.1f} s, {about['frames']} frames at {session.markers.rate:g} Hz; {about['markers']} markers, "
        f"{100 * float(str(about['lost'])):.1f} % of their samples lost."
    ]
    extra = [f"{about[name]} {name}" for name in ("ghosts", "swaps") if about[name]]
    if session.truth.offset:
        extra.append(f"a video that is {session.truth.offset:+.3f} s off")
    if extra:
        lines.append(f"With {', '.join(extra)}.")
    return tuple(lines)

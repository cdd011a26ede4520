"""Sessions and files: open, save, close, export."""

from __future__ import annotations

from pathlib import Path

from markerscope.app.actions.action import Action, ActionWith, Asks, first, needs_idle, needs_session
from markerscope.app.models import edits, exports
from markerscope.app.models.demo import DEMO_MARKERS, DEMO_VIDEO
from markerscope.app.models.workbench import Said, Workbench
from markerscope.solver.pipeline.session_file import EditedOutside


def may_close(bench: Workbench, asks: Asks) -> bool:
    """Whether the open session can be let go of: what runs is stopped and what is new is saved, if the user wants."""
    if not bench.document.is_open:
        return True
    if bench.runner.running:
        if not asks.stop_running():
            return False
        bench.runner.cancel()
    if bench.document.dirty:
        wanted = asks.save_first()
        if wanted is None or (wanted and not _save(bench, asks)):
            return False
    return True


def open_path(bench: Workbench, asks: Asks, path: Path) -> bool:
    """Open whatever a path is: a session, or a marker file to begin one with (dropped, recent, on the command line)."""
    from markerscope.solver.pipeline.session import session_folder

    if session_folder(path) is not None or (path.is_dir() and path.suffix == ".markerscope"):
        return may_close(bench, asks) and bench.open(path)
    how = asks.how_to_import(edits.existing(path, "marker file"))
    if how is None or not may_close(bench, asks):
        return False
    bench.document.new(**how)
    return True


def _open_markers(bench: Workbench, asks: Asks) -> None:
    path = asks.file_to_open("markers")
    if path is not None:
        open_path(bench, asks, path)


def _open_session(bench: Workbench, asks: Asks) -> None:
    path = asks.file_to_open("session")
    if path is not None:
        open_path(bench, asks, path)


OPEN: ActionWith[Path] = ActionWith("session.open_path", "Open", open_path)
"""Open a session or a marker file that was dropped, is recent, or was named on the command line."""
SESSIONS_WITH = (OPEN,)


def open_example(bench: Workbench, asks: Asks) -> None:
    """Begin a session from the embedded recording."""
    if may_close(bench, asks):
        bench.document.new({"marker_file": DEMO_MARKERS, "video_file": DEMO_VIDEO}, name="example")


def _save(bench: Workbench, asks: Asks) -> bool:
    bench.remember()
    if bench.document.untitled:
        return _save_as(bench, asks)
    news = bench.document.dirty
    try:
        bench.document.save()
    except EditedOutside as error:
        return _settle(bench, asks, error)
    if not news:
        bench.say(Said("note", "There was nothing new to save", bench.document.name))
    return True


def _settle(bench: Workbench, asks: Asks, error: EditedOutside) -> bool:
    """Two have changed the session: the user says whose it is to be. Neither is overwritten."""
    ways = ("Keep mine in another folder...", "Take the one on disk (can be undone)")
    chosen = asks.choice("The session file was edited outside. Neither is lost", ways)
    if chosen == 0 and not (reason := needs_idle(bench)):
        return _save_as(bench, asks)
    if chosen == 1:
        bench.document.take_from_disk()
        return True
    bench.say(Said("error", error.what, error.where or "", reason if chosen == 0 else error.remedy))
    return False


def _save_as(bench: Workbench, asks: Asks) -> bool:
    folder = asks.folder_to_save(bench.document.name)
    if folder is None:
        return False
    bench.remember()
    bench.document.save_as(folder)
    return True


def _close(bench: Workbench, asks: Asks) -> None:
    if may_close(bench, asks):
        bench.close()


def _quit(bench: Workbench, asks: Asks) -> None:
    if may_close(bench, asks):
        asks.quit()


def _export(bench: Workbench, asks: Asks) -> None:
    answer = asks.what_to_export()
    if answer is None:
        return
    folder, chosen = answer
    pictures = asks.pictures() if {"report", "pictures"} & set(chosen) else ()
    written = exports.export(bench.board, folder, chosen, pictures)
    bench.say(Said("note", f"{len(written)} files written", str(folder)))


def _export_angles(bench: Workbench, asks: Asks) -> None:
    path = asks.file_to_save("angles.csv")
    if path is not None:
        written = exports.export_angles(bench.board, path)
        bench.say(Said("note", f"{' and '.join(file.name for file in written)} written", str(path.parent)))


def _exportable(bench: Workbench) -> str:
    return needs_session(bench) or exports.why_not(bench.board)


def _input(name: str, what: str, title: str, help: str) -> Action:
    def run(bench: Workbench, asks: Asks) -> None:
        path = asks.file_to_open(what)
        if path is not None:
            bench.document.apply(edits.set_input(bench.document.session, name, path))

    return Action(f"input.{what}", title, "File", help, run, why_not=needs_session)


def _remove_video(bench: Workbench, asks: Asks) -> None:
    bench.document.apply(edits.set_input(bench.document.session, "video_file", None))


def _has_video(bench: Workbench) -> str:
    if reason := needs_session(bench):
        return reason
    return "" if "video_file" in bench.document.session.inputs else "the session has no video"


SESSION_ACTIONS = (
    Action(
        "session.markers",
        "Open markers...",
        "File",
        "Begin a session from a C3D, TRC, CSV or TSV file.",
        _open_markers,
        "Ctrl+O",
    ),
    Action(
        "session.open",
        "Open session...",
        "File",
        "Open a session as it was left.",
        _open_session,
        "Ctrl+Shift+O",
    ),
    Action("session.example", "Open the example", "File", "Begin a session from the embedded recording.", open_example),
    _input("marker_file", "markers", "Use other markers...", "Take another marker file, or the same where it is now."),
    _input("video_file", "video", "Add video...", "Take a video of the same movement."),
    _input("prior_file", "prior", "Add pose prior...", "Take poses that another program reconstructed from the video."),
    _input("camera_file", "camera", "Add camera...", "Take the camera from another trial's result."),
    _input("body_file", "body", "Use another body...", "Take an SMPL-layout model instead of the embedded body."),
    Action("input.no_video", "Remove video", "File", "Go on without the video.", _remove_video, why_not=_has_video),
    Action(
        "session.save",
        "Save",
        "File",
        "Write what was decided into the session's folder.",
        _save,
        "Ctrl+S",
        why_not=needs_session,
    ),
    Action(
        "session.save_as",
        "Save as...",
        "File",
        "Give the session another folder, results and all.",
        _save_as,
        "Ctrl+Shift+S",
        why_not=first(needs_session, needs_idle),
    ),
    Action(
        "export.files",
        "Export...",
        "Export",
        "Write results for other programs; every setting is written beside them.",
        _export,
        "Ctrl+E",
        why_not=_exportable,
    ),
    Action(
        "export.angles",
        "Export angles...",
        "Export",
        "Write the joint angles as CSV, with convention and settings in angles.json.",
        _export_angles,
        why_not=_exportable,
    ),
    Action("session.close", "Close session", "File", "Close the session.", _close, "Ctrl+W", why_not=needs_session),
    Action("window.quit", "Quit", "File", "Close the window.", _quit, "Ctrl+Q"),
)

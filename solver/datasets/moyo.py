"""MOYO (Tripathi et al. 2023): yoga, markers and fitted SMPL-X bodies at 60 Hz, pictures of eight cameras at 30 Hz."""

from __future__ import annotations

from pathlib import Path

from markerscope.solver.datasets.recording import (
    Dataset,
    Film,
    Recording,
    files_in,
    not_as_expected,
    side_by_side,
)
from markerscope.solver.datasets.request import Options

CAMERA = "YOGI_Cam_06"
SESSIONS = ("20220923_20220926_with_hands", "20221004_with_com")
_PLACES = (".", "MOYO", "data", "data/MOYO")
_MARKER_FOLDERS = ("pressure/{split}/pressure_mat_c3d", "vicon/{split}/c3d", "vicon/{split}")
"""The first is what Milef et al. (2024) read."""
_PICTURE_RATE = 30.0
_BOTH = (
    "ANK BHD BSH BWT ELB FHD FRM FSH FWT HEL IDX3 IDX6 IEL IHAND IWR KNE KNI MID0 MID6 MT1 MT5 OHAND OWR PNK3 PNK6 "
    "RNG3 RNG6 SHN THI THM3 THM6 TOE UPA ASI FIN HEE PSI SHO TIB WRA WRB"
).split()
_MIDDLE = "ARIEL C7 CLAV MBWT MFWT STRN T10 RBAK".split()
_ON_THE_BODY = {f"{side}{name}" for side in "LR" for name in _BOTH} | set(_MIDDLE)
"""The markers of both sessions; the files also hold those of the pressure mat."""


def find(folder: Path, options: Options) -> tuple[Recording, ...]:
    """The trials of a split: C3D, pictures (ZIP or a video of them) and the fitted body."""
    found = []
    for place in _PLACES:
        for session in SESSIONS:
            base = folder / place / session
            for path in _marker_files(base, options.split):
                reference = base / "mosh" / options.split / f"{path.stem}_stageii.pkl"
                found.append(
                    Recording(
                        path.stem,
                        path,
                        film=_film(base / "images" / options.split, path.stem),
                        reference=reference if reference.is_file() else None,
                    )
                )
        if found:
            return tuple(found)
    raise not_as_expected(f"MOYO ({options.split})", folder, f"{SESSIONS[0]} or {SESSIONS[1]}, unpacked but for images")


def _marker_files(base: Path, split: str) -> list[Path]:
    for place in _MARKER_FOLDERS:
        files = files_in(base / place.format(split=split), ".c3d")
        if files:
            return files
    return []


def _film(folder: Path, name: str) -> Film | None:
    packed = folder / f"{name}.zip"
    if packed.is_file():
        return Film(packed, CAMERA, _PICTURE_RATE, shrink=2)
    unpacked = folder / name
    return Film(unpacked, CAMERA, _PICTURE_RATE, shrink=2) if unpacked.is_dir() else None


def label(raw: str, options: Options) -> str | None:
    """The marker's name, if it is one on the body."""
    return raw if raw in _ON_THE_BODY else None


_ARM = side_by_side(("LUPA", "LELB", "LIEL", "LFRM", "LIWR", "LOWR", "LOHAND", "LIHAND"))
_LEG = side_by_side(("LTOE", "LMT5", "LMT1", "LHEL", "LANK", "LSHN", "LKNI", "LKNE", "LTHI"))
_SHOULDER = side_by_side(("LFSH", "LBSH", "LUPA", "LELB", "LIEL"))

MOYO = Dataset(
    title="MOYO",
    window_s=3.0,
    padding_s=2.0,
    find=find,
    label=label,
    parts={
        f"{side}_{part}": labels[side]
        for part, labels in (("arm", _ARM), ("leg", _LEG), ("shoulder", _SHOULDER))
        for side in ("left", "right")
    },
)

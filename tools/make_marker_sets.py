"""Make the marker sets that ship: published definitions of where markers are put, as places on the embedded body.

    python tools/make_marker_sets.py

Each place is a palpable landmark of the body, a point between landmarks, or a rough place that is then brought onto the
skin of its bone; the marker's centre is 9.5 mm above the skin there (Ghorbani and Black 2021). Spreads are round
figures: how far the same landmark, palpated on different people, ends from its place on a fitted body.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from markerscope.solver.body.bones import load_body
from markerscope.solver.body.bony import bony_sites
from markerscope.solver.core.skeleton import BONES, JOINTS
from markerscope.solver.fit.placement import Skin
from markerscope.solver.markerset.file import write_marker_set
from markerscope.solver.markerset.marker_set import MarkerSet, SetMarker

OFFSET_M = 0.0095
OUT = Path(__file__).parents[1] / "resources" / "marker_sets"
BONY, SOFT, LOOSE = 0.020, 0.030, 0.045
"""m: a bony landmark; one that is found less surely; a place that each laboratory chooses anew."""

CENTRAL = {
    # key: (bone, landmark or rough place on the mean body in m, spread, words)
    "c7": ("thorax", "c7", BONY, "spinous process of C7"),
    "t2": ("thorax", (0, 0.53, -0.09), SOFT, "spinous process of T2"),
    "t10": ("lower_thorax", (0, 0.31, -0.12), SOFT, "spinous process of T10"),
    "clav": ("thorax", "sternum_ij", BONY, "jugular notch"),
    "strn": ("thorax", "sternum_px", BONY, "xiphoid process"),
    "sacr": ("pelvis", "sacrum", BONY, "sacrum, midway between the posterior superior iliac spines"),
    "mai": ("thorax", "t8", SOFT, "midway between the inferior angles of the scapulae"),
    "top_head": ("head", (0, 0.80, 0.0), SOFT, "top of the head"),
    "front_head": ("head", (0, 0.74, 0.12), LOOSE, "forehead"),
    "rear_head": ("head", (0, 0.72, -0.12), LOOSE, "back of the head"),
    "rback": ("thorax", (-0.10, 0.44, -0.12), LOOSE, "right scapula"),
}
SIDED = {
    # for the left side; the right one is its mirror image
    "fhd": ("head", (0.07, 0.73, 0.09), SOFT, "temple"),
    "bhd": ("head", (0.07, 0.73, -0.06), SOFT, "back of the head, level with the temple"),
    "acromion": ("clavicle", "acromion", BONY, "acromion"),
    "clav_inner": ("thorax", (0.025, 0.49, 0.07), SOFT, "sternal end of the clavicle"),
    "upa": ("upper_arm", (0.33, 0.50, 0.02), LOOSE, "lateral upper arm"),
    "elbow_lat": ("upper_arm", "elbow_lateral", BONY, "lateral humeral epicondyle"),
    "elbow_med": ("upper_arm", "elbow_medial", BONY, "medial humeral epicondyle"),
    "frm": ("forearm", (0.60, 0.51, 0.0), LOOSE, "forearm"),
    "wra": ("forearm", "wrist_radius", BONY, "wrist, thumb side: radial styloid"),
    "wrb": ("forearm", "wrist_ulna", BONY, "wrist, little finger side: ulnar styloid"),
    "wrist": ("forearm", (0.715, 0.50, 0.0), SOFT, "back of the wrist, between the styloids"),
    "fin": ("hand", "hand_meta3", SOFT, "head of the third metacarpal"),
    "asis": ("pelvis", "asis", BONY, "anterior superior iliac spine"),
    "psis": ("pelvis", "psis", BONY, "posterior superior iliac spine"),
    "troch": ("thigh", (0.175, -0.03, 0.01), SOFT, "greater trochanter"),
    "thi": ("thigh", (0.17, -0.26, 0.02), LOOSE, "lateral thigh, between hip and knee"),
    "knee_lat": ("thigh", "knee_lateral", BONY, "lateral femoral epicondyle"),
    "knee_med": ("thigh", "knee_medial", BONY, "medial femoral epicondyle"),
    "fib": ("shank", "fibula_head", BONY, "head of the fibula"),
    "tub": ("shank", "tibial_tuberosity", BONY, "tibial tuberosity"),
    "tib": ("shank", (0.17, -0.62, 0.01), LOOSE, "lateral shank, between knee and ankle"),
    "shn": ("shank", (0.125, -0.62, 0.06), LOOSE, "front of the shin"),
    "ank": ("shank", "ankle_lateral", BONY, "lateral malleolus"),
    "mank": ("shank", "ankle_medial", BONY, "medial malleolus"),
    "hee": ("foot", "calcaneus", BONY, "posterior calcaneus"),
    "toe": ("foot", "toe", BONY, "head of the second metatarsal"),
    "mt1": ("foot", "meta1", BONY, "head of the first metatarsal"),
    "mt5": ("foot", "meta5", BONY, "head of the fifth metatarsal"),
    "offset": ("thorax", (0.10, 0.42, -0.12), LOOSE, "scapula, to tell the sides apart"),
}
PIG = {
    "FHD": "fhd", "BHD": "bhd", "SHO": "acromion", "UPA": "upa", "ELB": "elbow_lat", "FRM": "frm", "WRA": "wra",
    "WRB": "wrb", "FIN": "fin", "ASI": "asis", "PSI": "psis", "THI": "thi", "KNE": "knee_lat", "TIB": "tib",
    "ANK": "ank", "HEE": "hee", "TOE": "toe",
}  # fmt: skip
CMU = {
    "FHD": "fhd", "BHD": "bhd", "SHO": "acromion", "UPA": "upa", "ELB": "elbow_lat", "FRM": "frm", "WRA": "wra",
    "WRB": "wrb", "FIN": "fin", "FWT": "asis", "BWT": "psis", "THI": "thi", "KNE": "knee_lat", "SHN": "shn",
    "ANK": "ank", "HEE": "hee", "TOE": "toe", "MT5": "mt5",
}  # fmt: skip
HAYES = {
    "ASIS": "asis", "Shoulder": "acromion", "Elbow": "elbow_lat", "Wrist": "wrist", "Thigh": "thi", "Knee": "knee_lat",
    "Knee.Medial": "knee_med", "Shank": "tib", "Ankle": "ank", "Ankle.Medial": "mank", "Heel": "hee", "Toe": "toe",
}  # fmt: skip
IOR = {
    "IAS": "asis", "IPS": "psis", "FTC": "troch", "FLE": "knee_lat", "FME": "knee_med", "FAX": "fib", "TTC": "tub",
    "FAL": "ank", "TAM": "mank", "FCC": "hee", "FM1": "mt1", "FM2": "toe", "FM5": "mt5", "SAE": "acromion",
    "HLE": "elbow_lat", "HME": "elbow_med", "RSP": "wra", "USP": "wrb",
}  # fmt: skip
RAJAGOPAL = {
    "ASI": "asis", "PSI": "psis", "LFC": "knee_lat", "MFC": "knee_med", "LMAL": "ank", "MMAL": "mank", "CAL": "hee",
    "TOE": "toe", "MT5": "mt5", "ACR": "acromion", "LEL": "elbow_lat", "MEL": "elbow_med", "FAradius": "wra",
    "FAulna": "wrb",
}  # fmt: skip
OPENCAP_LEG = {
    "ASIS": "asis", "PSIS": "psis", "knee": "knee_lat", "mknee": "knee_med", "ankle": "ank", "mankle": "mank",
    "calc": "hee", "toe": "toe", "5meta": "mt5",
}  # fmt: skip
OPENCAP_ARM = {
    "Shoulder": "acromion", "Sternum": "clav_inner", "elbow_lat": "elbow_lat", "elbow_med": "elbow_med",
    "wrist_radius": "wra", "wrist_ulna": "wrb",
}  # fmt: skip


def main() -> None:
    """Write them all."""
    both = lambda names, left="L{}", right="R{}": {  # noqa: E731
        pattern.format(name): f"{side}:{key}"
        for side, pattern in (("left", left), ("right", right))
        for name, key in names.items()
    }
    sets = {
        "plug-in-gait": (
            {"C7": "c7", "T10": "t10", "CLAV": "clav", "STRN": "strn", "RBAK": "rback", "SACR": "sacr", **both(PIG)},
            "Plug-in Gait and CGM2, full body. Davis et al. (1991), Hum Mov Sci 10:575; Kadaba et al. (1990), J Orthop "
            "Res 8:383; Leboeuf et al. (2019), Gait Posture 69:235",
        ),
        "cmu-41": (
            {"C7": "c7", "T10": "t10", "CLAV": "clav", "STRN": "strn", "RBAC": "rback", **both(CMU)},
            "The 41 markers of the Carnegie Mellon University motion capture database: its marker placement guide",
        ),
        "helen-hayes": (
            {
                "Top.Head": "top_head", "Front.Head": "front_head", "Rear.Head": "rear_head", "V.Sacral": "sacr",
                "R.Offset": "right:offset", **both(HAYES, "L.{}", "R.{}"),
            },
            "Helen Hayes, full body. Kadaba et al. (1990), J Orthop Res 8:383; Davis et al. (1991), Hum Mov Sci 10:575",
        ),
        "ior-cast": (
            {"CV7": "c7", "TV2": "t2", "SJN": "clav", "SXS": "strn", "MAI": "mai", **both(IOR, "L_{}", "R_{}")},
            "Istituto Ortopedico Rizzoli and CAST. Cappozzo et al. (1995), Clin Biomech 10:171; Leardini et al. "
            "(2007), Gait Posture 26:560; names after van Sint Jan (2007), Color Atlas of Skeletal Landmark "
            "Definitions",
        ),
        "rajagopal": (
            {"C7": "c7", "CLAV": "clav", **both(RAJAGOPAL)},
            "The anatomical markers of the full-body model of Rajagopal et al. (2016), IEEE Trans Biomed Eng 63:2068",
        ),
        "opencap": (
            {
                "C7": "c7", **both({name: key for name, key in OPENCAP_LEG.items() if name.isupper()}, "L.{}", "r.{}"),
                **both({name: key for name, key in OPENCAP_LEG.items() if not name.isupper()}, "L_{}", "r_{}"),
                **both(OPENCAP_ARM, "L_{}", "R_{}"),
            },
            "The anatomical markers of the laboratory validation of Uhlrich et al. (2023), PLoS Comput Biol "
            "19:e1011462, which are those of Rajagopal et al. (2016)",
        ),
    }  # fmt: skip
    places = _places()
    for name, (names, source) in sets.items():
        markers = tuple(SetMarker(label, *_marker(places, key)) for label, key in names.items())
        notes = ("Places of anatomical names; markers of rigid plates are learnt from a trial of one's own.",)
        write_marker_set(OUT / f"{name}.toml", MarkerSet(name, markers, (), "shipped", source, notes))


def _marker(
    places: dict[str, tuple[int, np.ndarray, float, str]], key: str
) -> tuple[int, tuple[float, float, float], float, str, str]:
    bone, place, spread, words = places[key]
    x, y, z = np.round(place, 4).tolist()
    return bone, (x, y, z), spread, "", words


def _places() -> dict[str, tuple[int, np.ndarray, float, str]]:
    """Key, sided ones as ``left:asis`` -> bone, (3,) m, spread and words."""
    body = load_body()
    betas = np.zeros(body.shape_count)
    surface = body.surface(betas)
    sites = bony_sites(body)
    points, normals = sites.points(surface), sites.normals(body, surface)
    skin = Skin(body, betas)
    own = body.weights[skin.index].argmax(axis=1)
    found = {}

    def place(bone: int, where: object) -> np.ndarray:
        if isinstance(where, str):
            at = sites.names.index(where)
            return points[at] + OFFSET_M * normals[at]
        index = skin.index[own == bone]
        vertex = index[((surface[index] - np.array(where)) ** 2).sum(axis=1).argmin()]
        return surface[vertex] + OFFSET_M * skin.normal(np.array([vertex]))[0]

    joint = {bone: j for j, name in enumerate(JOINTS) for bone in [BONES[name]]}
    for key, (bone, where, spread, words) in CENTRAL.items():
        found[key] = (joint[bone], place(joint[bone], where), spread, words)
    for key, (bone, where, spread, words) in SIDED.items():
        for side, sign in (("left", 1.0), ("right", -1.0)):
            j = joint[bone] if bone in joint else joint[f"{side}_{bone}"]
            at = f"{side}_{where}" if isinstance(where, str) else (sign * where[0], *where[1:])
            found[f"{side}:{key}"] = (j, place(j, at), spread, f"{side} {words}")
    return found


if __name__ == "__main__":
    main()

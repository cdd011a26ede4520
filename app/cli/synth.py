"""The options of ``markerscope synth``: one for every setting of a synthetic session."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

_GROUPS: dict[str, tuple[tuple[str, Callable[[str], Any], str, str], ...]] = {
    "how long": (
        ("frames", int, "N", "frames of markers and video; a short motion is played forth and back (default: 450)"),
        ("rate", float, "HZ", "frames a second of both (default: 30)"),
        ("still", float, "FACTOR", "scale the motion about its mean pose (default: as it is)"),
    ),
    "the markers": (
        ("markers", int, "N", "how many, where they are spread at random (default: 40)"),
        ("part", str, "NAME", "the part of the body that alone has markers: left_arm, right_leg... (default: all)"),
        ("layout", str, "NAME", "uniform, or named places: full_body, plug_in_gait, left_arm... (default: uniform)"),
        ("misplaced_mm", float, "MM", "how far from its named place each marker sits (default: 0)"),
        ("apart_mm", float, "MM", "least distance of two markers (default: 30)"),
        ("offset_mm", float, "MM", "height above the skin (default: 9.5)"),
        ("offset_spread_mm", float, "MM", "its spread from marker to marker (default: 1.5)"),
        ("slide", float, "FACTOR", "times the usual sliding of skin over bone (default: 1)"),
        ("jitter_mm", float, "MM", "white noise of each coordinate (default: 0.4)"),
    ),
    "the body": (
        ("shape", str, "NAME", "inside or outside of what the program's own shapes reach (default: outside)"),
        ("spread", float, "SD", "standard deviation of the shape coefficients (default: 0.8)"),
        ("bones", float, "FRACTION", "standard deviation of bone lengths (default: 0.03)"),
        ("bumps", float, "M", "height of swellings and hollows of the skin (default: 0.01)"),
        ("centres_mm", float, "MM", "spread of joint centres about their usual place in the body (default: 0)"),
    ),
    "what is lost, and what is no marker": (
        ("lost", float, "FRACTION", "samples missing in gaps of heavy-tailed length (default: 0)"),
        ("longest_gap", float, "SECONDS", "of these gaps (default: 2)"),
        ("hidden_chance", float, "P", "chance of each marker in each frame to be hidden for 10 frames (default: 0)"),
        ("gap_statistics", Path, "FILE", "npz of real gaps to draw from (default: none)"),
        ("gap_times", float, "FACTOR", "times the frequency of gaps in that file (default: 1)"),
        ("ghosts", int, "N", "columns that are reflections (default: 0)"),
        ("swaps", int, "N", "exchanges of two near markers (default: 0)"),
    ),
    "the video": (
        ("video_noise", float, "FACTOR", "times the usual error of its poses (default: 1)"),
        ("video_bias_deg", float, "DEG", "constant part of the usual error of a joint (default: 4.5)"),
        ("video_wander_deg", float, "DEG", "slow part of the usual error of a joint (default: 3.4)"),
        ("video_tilt_deg", float, "DEG", "spread of the camera's pitch and roll (default: 5)"),
        ("video_lost", float, "FRACTION", "frames without the person, in spans (default: 0)"),
        ("video_flips", int, "N", "spans in which left is taken for right (default: 0)"),
        ("desync_frames", int, "N", "frames by which its clock is wrong, unknown to the solver (default: 0)"),
    ),
}


def synth_options(synth: argparse.ArgumentParser) -> None:
    """Declare them; what is not given stays None, and the setting keeps its default."""
    synth.add_argument(
        "motion", metavar="MOTION", help="a .bvh, an .amc with its .asf, or walk, squat, reach, lunge, jacks, kick..."
    )
    synth.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the files")
    synth.add_argument("--seed", type=int, default=0, metavar="N", help="of every random choice (default: 0)")
    synth.add_argument("--skeleton", type=Path, metavar="FILE", help="the .asf of an .amc (default: the one beside it)")
    synth.add_argument("--motion-rate", type=float, metavar="HZ", help="frame rate of an .amc (default: 120)")
    for title, options in _GROUPS.items():
        group = synth.add_argument_group(title)
        for name, kind, metavar, text in options:
            group.add_argument(f"--{name.replace('_', '-')}", type=kind, metavar=metavar, help=text)
        if title == "the markers":
            group.add_argument(
                "--no-nested",
                dest="nested",
                action="store_const",
                const=False,
                help="do not make fewer markers a subset of more",
            )
        if title == "the video":
            group.add_argument(
                "--video-wrong-shape", action="store_const", const=True, help="let it come with anybody's shape"
            )


def synth_settings(options: argparse.Namespace) -> dict[str, Any]:
    """The settings that were given, by name."""
    names = [name for group in _GROUPS.values() for name, *_ in group] + ["nested", "video_wrong_shape"]
    return {name: getattr(options, name) for name in names if getattr(options, name) is not None}

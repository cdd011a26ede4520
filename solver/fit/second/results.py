"""What a search for further minima leaves: another answer for one limb."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from markerscope.solver.core.skeleton import BONES, INDEX, JOINTS

LIMBS = {
    f"{side}_{limb}": tuple(INDEX[f"{side}_{joint}"] for joint in joints)
    for side in ("left", "right")
    for limb, joints in {"leg": ("hip", "knee", "ankle"), "arm": ("shoulder", "elbow", "wrist")}.items()
}
"""The bones of each limb that are turned; toes and fingers stay with the last."""


@dataclass(frozen=True)
class LimbAnswer:
    """Another pose of one limb, with its markers elsewhere on the skin, that costs hardly more than the answer.

    Attributes
    ----------
    limb : one of ``LIMBS``
    joint : index of the joint whose place differs most
    apart : m, how far, on average over the keyframes
    bone : index of the joint whose bone is turned most
    turn_deg : degrees, how far it is turned in its own frame
    excess : what it costs more, per keyframe
    confidence : 0..1, that the answer is the right one of the two
    chosen : True where it was asked for, so that what is described is the answer that it took the place of
    """

    limb: str
    joint: int
    apart: float
    bone: int
    turn_deg: float
    excess: float
    confidence: float
    chosen: bool = False

    LEAST_SURE: ClassVar[float] = 0.6
    """An answer with less is doubted; with more, the second one is only listed."""

    @property
    def sentence(self) -> str:
        """In words: which joint, how far, how sure, and what to do."""
        limb, joint = self.limb.replace("_", " "), JOINTS[self.joint].replace("_", " ")
        bone = BONES[JOINTS[self.bone]].replace("_", " ")
        where = (
            f"the {joint} centre {1000 * self.apart:.0f} mm away and the {bone} turned by {self.turn_deg:.0f} degrees "
            "in its own frame"
        )
        if self.chosen:
            return f"The second answer for the {limb} was taken by hand; the first has {where}."
        return (
            f"The markers of the {limb} allow a second answer, with {where}, nearly as well (confidence "
            f"{self.confidence:.2f} in the first): to see the other, put second = ['{self.limb}'] under "
            "[edits.fit] in session.toml; a further marker on the limb would tell them apart."
        )

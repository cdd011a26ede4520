"""One limb by itself: what it costs to turn its bones in their own frames, the same in every frame, with its markers.

A bone's frame can turn against its bone if the bone's markers take other places on the skin: in every frame alike, so
that the markers' distances hardly change. It is along this that a fit has further minima. The rest of the body, the
shape and the camera are held. Unknown: a right-hand turn of each of the limb's K bones, which carries what is below it
along but does not turn it, and the place of each of the M markers that move with them. S guesses are taken together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import exp_so3, log_so3, right_jacobian_inverse, skew
from markerscope.solver.core.skeleton import descendants
from markerscope.solver.fit import anatomical
from markerscope.solver.fit.kinematics import forward
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.pull.term import Pull
from markerscope.solver.fit.state import FREE, Observations, State, Weights


@dataclass(frozen=True, eq=False)
class Guesses:
    """S guesses at a limb.

    Attributes
    ----------
    turn : (S, K, 3, 3) of each bone in its own frame
    place : (S, M, 3) m, the limb's markers on the shaped rest body
    weights : (S, M, 24) what skin each rides on
    """

    turn: np.ndarray
    place: np.ndarray
    weights: np.ndarray

    def take(self, rows: np.ndarray) -> Guesses:
        """Some of them."""
        return Guesses(self.turn[rows], self.place[rows], self.weights[rows])

    def joined(self, other: Guesses) -> Guesses:
        """These, then the others."""
        return Guesses(
            *(np.concatenate([getattr(one, k) for one in (self, other)]) for k in ("turn", "place", "weights"))
        )


class Limb:
    """One limb of a fit.

    Parameters
    ----------
    body : with the shape that was found
    seen : N keyframes
    state : their fit
    weights : what each kind of evidence counts
    pull : what draws markers to landmarks, if anything does
    bones : (K) joints whose bones are turned
    skin : of the body
    every : so many keyframes there are for each that is looked at: what counts once counts for so much less
    """

    def __init__(
        self,
        body: Body,
        seen: Observations,
        state: State,
        weights: Weights,
        pull: Pull | None,
        bones: tuple[int, ...],
        skin: Skin,
        every: float = 1.0,
    ) -> None:
        self.bones, self.weights, self.skin, self.once = np.array(bones), weights, skin, 1 / every
        below = descendants()[bones[0]]
        self.marked = int(below[state.placement.weights.argmax(axis=1)].sum())
        self.markers = np.flatnonzero(state.placement.weights[:, below].any(axis=1))
        links, betas = forward(body, state.pose), state.pose.betas
        self.rest_joints, self.joint_place = links.rest_joints[self.bones], links.place[:, self.bones]
        self.first = links.place[:, bones[0]]  # (N, 3)
        self.frames = links.turn[:, self.bones]  # (N, K, 3, 3)
        self.segment = np.diff(self.rest_joints, axis=0)  # (K - 1, 3)
        parts = [descendants()[b] for b in bones]
        own = np.array([parts[k] & ~(parts[k + 1] if k + 1 < len(parts) else False) for k in range(len(parts))])
        self.own = own.T.astype(float)  # (24, K): toes and fingers ride on the last bone
        self.held = np.flatnonzero(~below)
        self.held_turn, self.held_shift = links.turn[:, self.held], links.shift[:, self.held]
        self.start_weights = state.placement.weights[self.markers]
        self.present = np.isfinite(seen.markers).all(axis=2)[:, self.markers]
        self.target = np.where(self.present[..., None], seen.markers[:, self.markers], 0.0)
        self.start = state.placement.shaped(betas)[self.markers]
        self._see_video(seen, state)
        self.pulled = np.zeros((0,), dtype=int), np.zeros((0, 3)), np.zeros(0)
        if pull is not None:
            mine = np.isin(pull.marker, self.markers)
            to = pull.targets.shaped(betas)[pull.landmark[mine]]
            self.pulled = np.searchsorted(self.markers, pull.marker[mine]), to, pull.strength[mine]

    def _see_video(self, seen: Observations, state: State) -> None:
        """What the video and the relaxed pose say of the limb's joints: rotations (N, K, 3, 3), and how much."""
        place = np.array([int(np.flatnonzero(b == FREE)[0]) for b in self.bones])
        self.local = state.pose.rotations[:, self.bones]
        self.video = seen.prior[:, self.bones] @ state.bias[place]
        spread = np.radians(np.broadcast_to(self.weights.prior_deg, len(FREE))[place])
        self.trust = np.where(seen.tracked, 1.0, 0.15)[:, None] / spread**2  # (N, K)
        self.kernel = (3 * spread) ** 2
        self.relaxed = anatomical.mean_pose()[self.bones]
        self.habit = self.weights.anatomical / anatomical.spread()[self.bones] ** 2  # (K, 3)

    def joints(self, guesses: Guesses) -> np.ndarray:
        """(S, N, K, 3) m, where each bone begins."""
        turned = self.frames @ guesses.turn[:, None]  # (S, N, K, 3, 3)
        steps = np.einsum("snkab,kb->snka", turned[:, :, :-1], self.segment)
        return np.concatenate(
            [np.broadcast_to(self.first, (len(turned), *self.first.shape))[:, :, None], steps], axis=2
        ).cumsum(axis=2)

    def turned_apart(self, guesses: Guesses, row: int) -> np.ndarray:
        """(S, K) degrees of each bone against that of one of the guesses."""
        between = np.swapaxes(guesses.turn[row], -1, -2) @ guesses.turn
        return np.degrees(np.linalg.norm(log_so3(between), axis=-1))

    def at(self, turn: np.ndarray) -> Guesses:
        """The answer's markers, and these turns (S, K, 3, 3)."""
        shape = (len(turn), 1, 1)
        return Guesses(turn, np.tile(self.start, shape), np.tile(self.start_weights, shape))

    def placed_again(self, guesses: Guesses) -> Guesses:
        """The same turns, each marker where it is on average as its bones then carry it, on the skin that is there."""
        turned, joints = self.frames @ guesses.turn[:, None], self.joints(guesses)
        where, blended, _ = self._where(guesses, turned, joints)
        residual = (where - self.target) * self.present[..., None]
        moved = np.einsum("snmab,snma->smb", blended, residual) / np.maximum(self.present.sum(0), 1)[:, None]
        return self._on_skin(guesses.turn, guesses.place - moved)

    def _on_skin(self, turn: np.ndarray, place: np.ndarray) -> Guesses:
        points, _ = self.skin.attach(place.reshape(-1, 3))
        return Guesses(turn, place, points.weights.reshape(*place.shape[:2], -1))

    def _where(
        self, guesses: Guesses, turned: np.ndarray, joints: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of each marker (S, N, M): where it should be, how it turns; and its share (S, M, K) of each bone."""
        share, held = guesses.weights @ self.own, guesses.weights[..., self.held]
        shift = joints - np.einsum("snkab,kb->snka", turned, self.rest_joints)
        frames, count = len(self.first), len(turned)
        fixed = np.einsum("smk,snka->snma", share, shift) + np.einsum("smj,nja->snma", held, self.held_shift)
        blended = share[:, None] @ turned.reshape(count, frames, -1, 9)
        blended = blended + held[:, None] @ self.held_turn.reshape(1, frames, -1, 9)
        blended = blended.reshape(*blended.shape[:3], 3, 3)
        return np.einsum("snmab,smb->snma", blended, guesses.place) + fixed, blended, share

    def linearised(
        self, guesses: Guesses, marker: float, kernel: float, slopes: bool = True
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(S,) cost, summed over frames; with ``slopes`` the Gauss-Newton matrix (S, D, D) and slope (S, D) as well."""
        weights, count, bones = self.weights, len(guesses.turn), len(self.bones)
        place, joints = guesses.place, self.joints(guesses)
        turned = self.frames @ guesses.turn[:, None]
        where, blended, share = self._where(guesses, turned, joints)
        residual = where - self.target
        squared = (residual**2).sum(-1)
        factor = 1 / (1 + squared / kernel**2)
        information = self.present / marker**2
        cost = (information * squared * factor).sum(axis=(1, 2))
        surface = self.skin.attach(place.reshape(-1, 3))[1]
        normal = surface.normal.reshape(place.shape)
        height = ((place - surface.point.reshape(place.shape)) * normal).sum(-1) - weights.offset
        cost = cost + self.once * (height**2).sum(1) / weights.offset_spread**2
        at, to, strength = self.pulled
        strength = self.once * strength
        gap = place[:, at] - to
        cost = cost + (strength * (gap**2).sum(-1)).sum(1)
        # the joints: R_k' = D_(k-1)^T R_k D_k
        above = np.concatenate([np.broadcast_to(np.eye(3), (count, 1, 3, 3)), guesses.turn[:, :-1]], axis=1)
        local = np.swapaxes(above, -1, -2)[:, None] @ self.local @ guesses.turn[:, None]  # (S, N, K, 3, 3)
        off = log_so3(np.swapaxes(self.video, -1, -2) @ local)
        off2 = (off**2).sum(-1)
        cost = cost + (self.trust * self.kernel * np.log1p(off2 / self.kernel)).sum(axis=(1, 2))
        relaxed = log_so3(np.swapaxes(self.relaxed, -1, -2) @ local)
        cost = cost + (self.habit * relaxed**2).sum(axis=(1, 2, 3))
        if not slopes:
            return cost, np.zeros(0), np.zeros(0)
        size = 3 * bones + 3 * place.shape[1]
        h, g = np.zeros((count, size, size)), np.zeros((count, size))
        # markers: turning bone k alone moves its own points, and carries the joint below it along
        by = np.zeros((*residual.shape, 3 * bones))
        arms = place[:, :, None] - self.rest_joints  # (S, M, K, 3)
        lower = share[..., ::-1].cumsum(-1)[..., ::-1]
        for k in range(bones):
            lever = share[:, :, k, None] * arms[:, :, k]
            if k + 1 < bones:
                lever = lever + lower[:, :, k + 1, None] * self.segment[k]
            by[..., 3 * k : 3 * k + 3] = -turned[:, :, None, k] @ skew(lever)[:, None]
        info = information * factor**2
        weighted = info[..., None, None] * by
        p = 3 * bones
        h[:, :p, :p] = np.einsum("snmai,snmaj->sij", weighted, by, optimize=True)
        g[:, :p] = np.einsum("snmai,snma->si", weighted, residual, optimize=True)
        cross = np.einsum("snmai,snmab->simb", weighted, blended, optimize=True).reshape(count, p, -1)
        h[:, :p, p:], h[:, p:, :p] = cross, np.swapaxes(cross, 1, 2)
        own = np.einsum("snm,snmab,snmac->smbc", info, blended, blended, optimize=True)
        own += self.once * normal[..., :, None] * normal[..., None, :] / weights.offset_spread**2
        own += np.eye(3) / weights.slide**2
        np.add.at(own, (slice(None), at), strength[:, None, None] * np.eye(3))  # type: ignore[arg-type]
        slope = np.einsum("snm,snmab,snma->smb", info, blended, residual, optimize=True)
        slope += self.once * normal * height[..., None] / weights.offset_spread**2
        np.add.at(slope, (slice(None), at), strength[:, None] * gap)  # type: ignore[arg-type]
        for m in range(place.shape[1]):
            q = slice(p + 3 * m, p + 3 * m + 3)
            h[:, q, q] = own[:, m]
        g[:, p:] = slope.reshape(count, -1)
        self._add_joints(h, g, guesses, local, off, off2, relaxed)
        return cost, h, g

    def _add_joints(
        self,
        h: np.ndarray,
        g: np.ndarray,
        guesses: Guesses,
        local: np.ndarray,
        off: np.ndarray,
        off2: np.ndarray,
        relaxed: np.ndarray,
    ) -> None:
        """To first order log(V^T R') turns as D_k does, less what D_(k-1) turns it back by."""
        trust = (self.trust / (1 + off2 / self.kernel))[..., None] + np.zeros(3)
        habit = np.swapaxes(right_jacobian_inverse(relaxed), -1, -2) @ (self.habit * relaxed)[..., None]
        both = trust * off + habit[..., 0]
        for k in range(len(self.bones)):
            q = slice(3 * k, 3 * k + 3)
            block = (trust[:, :, k] + self.habit[k]).sum(1)
            force = both[:, :, k].sum(1)
            h[:, q, q] += block[:, :, None] * np.eye(3)
            g[:, q] += force
            if k:
                o = slice(3 * k - 3, 3 * k)
                back = np.swapaxes(local[:, :, k], -1, -2)  # (S, N, 3, 3): D_(k-1) seen from below
                each = trust[:, :, k] + self.habit[k]
                mixed = np.einsum("sna,snab->sab", each, back)
                h[:, q, o] -= mixed
                h[:, o, q] -= np.swapaxes(mixed, 1, 2)
                h[:, o, o] += np.einsum("sna,snab,snac->sbc", each, back, back)
                g[:, o] -= np.einsum("snab,sna->sb", back, both[:, :, k])

    def moved(self, guesses: Guesses, step: np.ndarray) -> Guesses:
        """The guesses after a step (S, D)."""
        p = 3 * len(self.bones)
        turns = step[:, :p].reshape(len(step), -1, 3).clip(-0.3, 0.3)
        slide = step[:, p:].reshape(guesses.place.shape).clip(-0.03, 0.03)
        return self._on_skin(guesses.turn @ exp_so3(turns), guesses.place + slide)

    def descend(self, guesses: Guesses, marker: float, kernel: float, steps: int) -> tuple[Guesses, np.ndarray]:
        """Damped Gauss-Newton of every guess by itself; a step is kept only where it costs less."""
        damping = np.full(len(guesses.turn), 1e-3)
        cost, h, g = self.linearised(guesses, marker, kernel)
        for _ in range(steps):
            diagonal = np.einsum("sii->si", h)
            diagonal += damping[:, None] * diagonal + 1e-6
            tried = self.moved(guesses, -np.linalg.solve(h, g[..., None])[..., 0])
            new_cost, new_h, new_g = self.linearised(tried, marker, kernel)
            better = new_cost < cost
            damping = np.where(better, np.maximum(damping * 0.3, 1e-6), np.minimum(damping * 10, 1e8))
            taken = better[:, None, None]
            guesses = Guesses(
                np.where(taken[..., None], tried.turn, guesses.turn),
                np.where(taken, tried.place, guesses.place),
                np.where(taken, tried.weights, guesses.weights),
            )
            gain = np.where(better, (cost - new_cost) / cost, 0)
            cost, g = np.where(better, new_cost, cost), np.where(better[:, None], new_g, g)
            h = np.where(better[:, None, None], new_h, h)
            if better.any() and gain.max() < 1e-4:
                break
        return guesses, cost

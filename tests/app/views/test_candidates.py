"""Candidates, answers and descents of real, short solves by both methods, and of made-up ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from markerscope.app.views import bodies
from markerscope.app.views.candidates import (
    FATES,
    CandidateTable,
    bone_names,
    candidate_table,
    chains_of,
    coverage,
    covered_by,
)
from markerscope.app.views.convergence import of_orientation, of_paper
from markerscope.app.views.hypotheses import hypotheses_picture
from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import INDEX, subtrees
from markerscope.solver.fit.doubts.doubt import Doubt
from markerscope.solver.fit.doubts.rules import Verdict
from markerscope.solver.fit.published.results import PaperLocalization
from markerscope.solver.fit.results import Localization, Orientation


def rows_of(table: CandidateTable, step: str) -> list[int]:
    return [row.pool for row in (table.rows[i] for s in table.steps if s.name == step for i in s.rows)]


def test_before_the_ranking_every_hypothesis_waits(results: Mapping[str, Any]) -> None:
    found: Localization = results["localize"]
    table = candidate_table(found)
    assert [row.fate for row in table.rows] == ["found"] * len(found.start)
    assert np.allclose([row.distance for row in table.rows], found.cost_mm)
    assert [len(step.rows) for step in table.steps] == [len(found.start), 0, 0, 0]
    assert all(row.candidate == -1 and np.isnan(row.score) for row in table.rows)


def test_every_hypothesis_meets_its_fate(results: Mapping[str, Any]) -> None:
    found, ranked = results["localize"], results["orient"]
    table = candidate_table(found, ranked, in_use=1, covered={0: 0.75})
    assert sorted(rows_of(table, "Pool")) == list(range(len(found.start)))
    assert {row.fate for row in table.rows} <= set(FATES)
    in_order = [row.candidate for row in table.rows if row.candidate >= 0]
    assert in_order == list(range(len(ranked.candidates)))
    for row in table.rows:
        if row.candidate >= 0:
            own = ranked.candidates[row.candidate]
            assert (row.pool, row.score, row.part) == (own.hypothesis, own.energy, own.part)
            assert (row.fate == "refined") == own.refined and row.can_pin
        else:
            assert row.fate == "merged"
    sets = [set(rows_of(table, step.name)) for step in table.steps]
    assert sets[0] >= sets[1] >= sets[2] >= sets[3]
    assert len(sets[3]) == sum(own.refined for own in ranked.candidates)
    assert table.rows[0].margin == 1.0 and table.rows[0].covered == 0.75
    assert [row.candidate for row in table.rows if row.in_use] == [1]
    behind = [row for row in table.rows if row.fate == "left behind"]
    assert all(np.isnan(row.margin) for row in behind), "scored on few keyframes, they cannot be compared with the best"


def test_what_ran_into_a_better_one_comes_last(results: Mapping[str, Any]) -> None:
    found, ranked = results["localize"], results["orient"]
    gone = ranked.candidates[1].hypothesis
    fewer = replace(ranked, candidates=(ranked.candidates[0], *ranked.candidates[2:]))
    table = candidate_table(found, fewer)
    assert (table.rows[-1].pool, table.rows[-1].fate, table.rows[-1].candidate) == (gone, "merged", -1)
    assert gone in rows_of(table, "Kept") and gone not in rows_of(table, "Refined")


def test_headings_are_where_the_camera_looks(results: Mapping[str, Any]) -> None:
    """The heading before and after relaxing are angles of the same thing: most stay near."""
    table = candidate_table(results["localize"], results["orient"])
    before = {row.pool: row.heading_deg for row in candidate_table(results["localize"]).rows}
    turned = [abs((row.heading_deg - before[row.pool] + 180) % 360 - 180) for row in table.rows if row.candidate >= 0]
    assert np.median(turned) < 30, turned


def test_chains_go_from_the_pool_to_the_scored(paper_results: Mapping[str, Any]) -> None:
    found: PaperLocalization = paper_results["localize"]
    table = candidate_table(found, paper_results["orient"], in_use=0)
    pool, pruned, scored, refined = table.steps
    assert len(pool.rows) == found.chains == len(subtrees(found.pruned.shape[1]))
    assert len(pruned.rows) == len(found.pruned)
    assert len(scored.rows) == len(found.candidates) > 0
    assert len(refined.rows) == len(paper_results["solve"].yaws)
    assert set(pool.rows) >= set(pruned.rows) >= set(scored.rows) and not set(pool.rows) & set(refined.rows)
    scores = [table.rows[i].score for i in scored.rows]
    assert scores == sorted(scores)
    assert np.isclose(scores[0], 1e6 * min(fit.chamfer for fit in found.candidates))
    for i in refined.rows:
        assert paper_results["orient"].candidates[table.rows[i].candidate].refined and table.rows[i].can_pin
    assert not any(table.rows[i].can_pin for i in pool.rows), "a chain is no start of a fit"
    pinned = [row for row in table.rows if row.candidate >= 0]
    assert sorted(row.candidate for row in pinned) == list(range(len(paper_results["orient"].candidates)))
    for row in pinned:
        if row.fate == "scored":
            own = paper_results["orient"].candidates[row.candidate]
            assert own.hypothesis == row.pool and np.isclose(own.energy, row.score)


def test_chains_not_yet_scored_wait(paper_results: Mapping[str, Any]) -> None:
    found = replace(paper_results["localize"], candidates=paper_results["localize"].candidates[:2], chosen=-1)
    fates = [row.fate for row in candidate_table(found).rows]
    assert fates.count("scored") == 2
    assert fates.count("kept") == len(found.pruned) - 2
    assert fates.count("too alike") == found.chains - len(found.pruned)
    none = replace(found, candidates=())
    assert "whole body" in candidate_table(none).steps[2].help


def test_bones_are_named_once_from_the_pelvis_on() -> None:
    bones = [INDEX["left_knee"], INDEX["left_hip"], -1, INDEX["left_knee"]]
    assert bone_names(bones) == ("left thigh", "left shank")


def test_coverage_counts_markers_that_are_mostly_near() -> None:
    markers = np.zeros((4, 4, 3))
    points = np.zeros((4, 4, 3))
    points[:, 1, 0] = 0.05  # always far
    points[:2, 2, 0] = 0.05  # far half of the time: near enough
    markers[:, 3] = np.nan  # never seen: does not count
    assert np.isclose(coverage(points, markers), 2 / 3)
    assert coverage(points, markers, within=0.06) == 1.0
    assert np.isnan(coverage(points, np.full_like(markers, np.nan)))


def test_the_best_candidates_ghost_covers_the_markers(results: Mapping[str, Any], body: Body) -> None:
    """The ghost stands where the fit's residual says that it does."""
    found, ranked, markers = results["localize"], results["orient"], results["markers"]
    ghost = bodies.of_candidate(body, ranked.candidates[0], found, markers)
    frames = found.many
    places = ghost.places_over(ghost.times)
    assert places.shape == (len(frames), len(found.markers), 3)
    measured = markers.positions[frames][:, found.markers]
    distance = np.nanmedian(np.linalg.norm(places - measured, axis=2))
    assert distance < 0.02, f"{1000 * distance:.1f} mm"
    assert coverage(places, measured) > 0.9
    assert abs(covered_by(ghost, markers) - coverage(places, measured)) < 0.1
    worst = bodies.of_candidate(body, ranked.candidates[-1], found, markers)
    assert coverage(worst.places_over(worst.times), measured[: len(worst.times)]) < 1.0


def test_a_hypothesis_starts_where_its_cost_says(results: Mapping[str, Any], body: Body) -> None:
    found, markers = results["localize"], results["markers"]
    ghost = bodies.of_hypothesis(body, found, 0, results["prior"], results["sync"], markers)
    skin = ghost.places_over(ghost.times)
    measured = markers.positions[found.few][:, found.markers]
    seen = np.isfinite(measured).all(axis=2)
    rms = 1000 * np.sqrt(((skin - measured)[seen] ** 2).sum(axis=1).mean())
    # The search lays markers on points 9.5 mm above these vertices.
    assert abs(rms - found.cost_mm[0]) < 12, (rms, found.cost_mm[0])


def test_a_chain_stands_as_the_candidate_made_from_it(paper_results: Mapping[str, Any], body: Body) -> None:
    found, ranked, markers = paper_results["localize"], paper_results["orient"], paper_results["markers"]
    own = next(c for c in ranked.candidates if not c.refined)
    chain = bodies.of_chain(body, found, own.hypothesis, paper_results["prior"], paper_results["sync"], markers)
    ghost = bodies.of_candidate(body, own, found, markers)
    for time in ghost.times[[0, -1]]:
        error = np.abs(chain.joints(time) - ghost.joints(time)).max()
        assert error < 1e-6, f"{error} m"


def test_cards_are_the_refined_answers_with_bars_of_one_scale(results: Mapping[str, Any]) -> None:
    ranked: Orientation = results["orient"]
    shown = hypotheses_picture(ranked, in_use=0)
    assert [card.candidate for card in shown.cards] == [i for i, c in enumerate(ranked.candidates) if c.refined]
    for card in shown.cards:
        total = sum(term.value for term in card.terms)
        assert np.isclose(total, card.energy) and total <= shown.highest
        assert [term.name for term in card.terms] == [term.name for term in shown.cards[0].terms]
    assert shown.cards[0].margin == 1.0 and shown.cards[0].in_use
    assert len({term.colour for term in shown.cards[0].terms}) == len(shown.cards[0].terms)
    assert "confidence" in shown.sentence


def test_the_runner_up_is_named(results: Mapping[str, Any]) -> None:
    ranked: Orientation = results["orient"]
    one = ranked.candidates[0]
    other = replace(one, part="left arm", energy=1.4 * one.energy)
    shown = hypotheses_picture(replace(ranked, candidates=(one, other), runner_up=1, margin=1.4))
    assert "left arm" in shown.sentence and "1.40" in shown.sentence
    assert [card.runner_up for card in shown.cards] == [False, True]
    assert np.isclose(shown.cards[1].margin, 1.4)
    assert shown.cards[1].same_as_first, "same bones, same heading"
    alone = hypotheses_picture(replace(ranked, candidates=(one,), runner_up=-1, margin=float("inf")))
    assert alone.sentence.startswith("No different answer")


def test_doubts_and_the_confidence_that_they_leave_are_said(results: Mapping[str, Any]) -> None:
    doubt = Doubt("turning camera", "The camera turns: stand it still.")
    shown = hypotheses_picture(results["orient"], verdict=Verdict(0.42, (doubt,), (), ()))
    assert "confidence 42 %" in shown.sentence and shown.sentence.endswith(doubt.sentence)


def test_the_papers_cards_show_the_terms_of_stage_four(paper_results: Mapping[str, Any]) -> None:
    solved, ranked = paper_results["solve"], paper_results["orient"]
    shown = hypotheses_picture(ranked, solved=solved)
    assert {card.start_deg for card in shown.cards} == {yaw.start_deg for yaw in solved.yaws}
    for card in shown.cards:
        yaw = next(yaw for yaw in solved.yaws if yaw.start_deg == card.start_deg)
        assert np.isclose(sum(term.value for term in card.terms), yaw.markers.descent.energy)
        assert np.isclose(card.energy, 1e6 * yaw.one_way)


def test_the_default_methods_descents(results: Mapping[str, Any]) -> None:
    ranked = results["orient"]
    curves = of_orientation(ranked)
    assert [curve.candidate for curve in curves] == list(range(len(ranked.candidates)))
    for curve, own in zip(curves, ranked.candidates):
        assert curve.energy.tolist() == list(own.trace)
        assert curve.iteration.tolist() == list(range(1, len(own.trace) + 1))


def test_the_papers_descents_keep_bodies_to_scrub_through(paper_results: Mapping[str, Any], body: Body) -> None:
    found, solved, markers = paper_results["localize"], paper_results["solve"], paper_results["markers"]
    curves = of_paper(found, solved, paper_results["orient"])
    stages = {curve.stage for curve in curves}
    assert stages == {"part search", "2: pose", "4: markers on vertices", "5: refinement"}
    last = next(curve for curve in curves if curve.stage.startswith("5"))
    assert last.candidate == 0, "the first candidate is the one that was refined"
    assert last.trace is not None and last.vertex is not None
    assert last.iteration[0] == 0 and last.step(0) == 0
    assert last.step(int(last.iteration[-1]) + 5) == len(last.iteration) - 1
    between = int(last.iteration[1])
    assert last.step(between) == 1
    ended = bodies.of_iteration(body, last.trace, len(last.iteration) - 1, found, markers, last.vertex)
    kept = last.trace.frames
    state = solved.refined.body
    wanted, _ = body.pose(
        state.rotations[kept], np.concatenate([state.betas, np.zeros(8)]), state.trans[kept], last.vertex
    )
    error = np.abs(ended.places_over(ended.times) - wanted).max()
    assert error < 1e-4, f"{error} m"
    assert np.isclose(last.energy[-1], solved.refined.descent.energy)


def test_a_search_alone_has_descents_already(paper_results: Mapping[str, Any]) -> None:
    curves = of_paper(paper_results["localize"])
    assert curves and {curve.stage for curve in curves} == {"part search"}
    assert {curve.candidate for curve in curves} == {-1}


@pytest.mark.parametrize("iterations", [0, 1])
def test_endings_are_said(paper_results: Mapping[str, Any], iterations: int) -> None:
    found = paper_results["localize"]
    fit = found.candidates[0]
    descent = replace(fit.descent, converged=bool(iterations))
    curve = of_paper(replace(found, candidates=(replace(fit, descent=descent),)))[0]
    assert curve.ended == ("converged" if iterations else f"stopped at the cap of {descent.iterations} iterations")


def test_chains_are_numbered_told_apart_and_say_which_they_repeat(paper_results: Mapping[str, Any]) -> None:
    found: PaperLocalization = paper_results["localize"]
    rows = [row for row in candidate_table(found, paper_results["orient"]).rows if row.candidate < 0 or row.chain]
    chains = chains_of(found)
    assert set(chains) == set(subtrees(found.groups)) and len(chains) == found.chains
    every = set.intersection(*(set(bone_names(sorted(chain))) for chain in chains))
    for row in rows:
        own = chains[row.chain - 1]
        assert row.bones == bone_names(sorted(own)) and not set(row.differs) & every
        if row.fate == "scored":
            fit = found.candidates[row.pool]
            assert (row.energy, row.score) == (fit.descent.energy, 1e6 * fit.chamfer)
        if row.fate == "too alike":
            shared = [len(own & kept) for kept in chains[: len(found.pruned)]]
            assert shared[row.repeats - 1] == max(shared) > 0.5 * len(own)
        assert not row.can_pin

"""Everything that can be done in the window, as a table that needs no window."""

from __future__ import annotations

from typing import Any

from markerscope.app.actions.action import MENUS, Action, Actions, ActionWith, Asks
from markerscope.app.actions.candidate_actions import CANDIDATES_WITH
from markerscope.app.actions.clean_actions import CLEAN_ACTIONS, CLEAN_WITH
from markerscope.app.actions.edit_actions import EDIT_ACTIONS, EDITS_WITH
from markerscope.app.actions.group_actions import GROUPS_WITH
from markerscope.app.actions.landmark_actions import LANDMARK_ACTIONS
from markerscope.app.actions.neutral_actions import NEUTRAL_ACTIONS
from markerscope.app.actions.play_actions import PLAY_ACTIONS, PLAY_WITH
from markerscope.app.actions.run_actions import RUN_ACTIONS, RUNS_WITH
from markerscope.app.actions.session_actions import SESSION_ACTIONS, SESSIONS_WITH
from markerscope.app.actions.track_actions import TRACK_ACTIONS, TRACKS_WITH
from markerscope.app.actions.view_actions import VIEW_ACTIONS, VIEWS_WITH

ACTIONS = (
    *SESSION_ACTIONS,
    *EDIT_ACTIONS,
    *LANDMARK_ACTIONS,
    *CLEAN_ACTIONS,
    *TRACK_ACTIONS,
    *NEUTRAL_ACTIONS,
    *VIEW_ACTIONS,
    *PLAY_ACTIONS,
    *RUN_ACTIONS,
)
"""Every action, in the order of the menus."""
ACTIONS_WITH: tuple[ActionWith[Any], ...] = (
    *SESSIONS_WITH,
    *EDITS_WITH,
    *GROUPS_WITH,
    *CLEAN_WITH,
    *TRACKS_WITH,
    *CANDIDATES_WITH,
    *VIEWS_WITH,
    *PLAY_WITH,
    *RUNS_WITH,
)
"""Every action that is done to something: ``Actions.do`` takes it together with that."""

__all__ = ["ACTIONS", "ACTIONS_WITH", "MENUS", "Action", "ActionWith", "Actions", "Asks"]

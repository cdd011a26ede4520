"""Everything that can be done in the window, as a table that needs no window."""

from __future__ import annotations

from markerscope.app.actions.action import MENUS, Action, Actions, Asks
from markerscope.app.actions.clean_actions import CLEAN_ACTIONS
from markerscope.app.actions.edit_actions import EDIT_ACTIONS
from markerscope.app.actions.landmark_actions import LANDMARK_ACTIONS
from markerscope.app.actions.neutral_actions import NEUTRAL_ACTIONS
from markerscope.app.actions.play_actions import PLAY_ACTIONS
from markerscope.app.actions.run_actions import RUN_ACTIONS
from markerscope.app.actions.session_actions import SESSION_ACTIONS
from markerscope.app.actions.view_actions import VIEW_ACTIONS

ACTIONS = (
    *SESSION_ACTIONS,
    *EDIT_ACTIONS,
    *LANDMARK_ACTIONS,
    *CLEAN_ACTIONS,
    *NEUTRAL_ACTIONS,
    *VIEW_ACTIONS,
    *PLAY_ACTIONS,
    *RUN_ACTIONS,
)
"""Every action, in the order of the menus."""

__all__ = ["ACTIONS", "MENUS", "Action", "Actions", "Asks"]

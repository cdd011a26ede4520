"""Markerscope: from unlabelled optical markers and one ordinary video to a body and its joint angles."""

"""What everything else speaks in: errors, progress, rotations, markers, the skeleton, requests, measures."""

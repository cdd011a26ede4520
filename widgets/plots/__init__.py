"""What is drawn over time, over markers and over iterations; painted by QPainter, decimated to pixels."""

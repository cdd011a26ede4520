"""Cards, bars and lists that stand about the plots: each takes frozen records and emits signals."""

"""Tables on columns of plain values."""

"""Solutions as pieces that can be drawn, written and compared."""

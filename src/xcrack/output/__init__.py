"""Solutions as pieces that are written, drawn and compared."""

"""Predicted and measured: tests of others as values, and what xcrack says to each of them."""

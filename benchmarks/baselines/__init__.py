"""Other methods and programs on the same scenes."""

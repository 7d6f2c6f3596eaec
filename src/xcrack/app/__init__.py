"""Case files and the command line."""

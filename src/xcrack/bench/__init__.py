"""Work against precision: `python -m xcrack.bench` measures, draws and says who is ahead."""

"""`python -m xcrack` is the command `xcrack`."""

from xcrack.command.main import main

if __name__ == "__main__":
    raise SystemExit(main())

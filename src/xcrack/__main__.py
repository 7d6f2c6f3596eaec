"""`python -m xcrack` is the command `xcrack`."""

from xcrack.app.main import main

if __name__ == "__main__":
    raise SystemExit(main())

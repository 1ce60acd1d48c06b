"""``python -m meltemi``."""

from meltemi.app.cli import main

if __name__ == "__main__":
    main()

"""Controllers and actuators."""

import meltemi.numbers.records  # noqa: F401 - by it kernels know what a table of a vector is

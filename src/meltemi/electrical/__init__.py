"""Generator, converters, DC link and grid connection: equations, controls and protection."""

FEATURE = "the electrical system"
KERNELS = ("advance.py", "circuit.py", "control.py", "part.py", "tables.py")

"""Generator, converters, DC link and grid connection: equations, controls and protection."""

FEATURE = "the electrical system"

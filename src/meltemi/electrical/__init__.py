"""Generator, converters, DC link and grid connection: equations, controls and protection."""

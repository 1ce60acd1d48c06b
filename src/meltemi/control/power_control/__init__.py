"""Power control: torque below rated, a power reference, and the pitch that goes with it."""

FEATURE = "power control"

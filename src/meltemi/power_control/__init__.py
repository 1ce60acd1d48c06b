"""Power control: maximum power below the power reference, and tracking of the reference."""

FEATURE = "power control"

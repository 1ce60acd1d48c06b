"""Supervisory control: state machine of operation and yaw protection."""

FEATURE = "the supervisor"

"""Supervisory control: tables of states and transitions, yaw protection, and the kernel that walks them."""

FEATURE = "the supervisor"

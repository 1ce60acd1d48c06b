"""Substructures of many members: jackets, tripods, flexible floaters; their water, section loads and joints.

Reference: docs/theory/frames.md (F-1 ...).
"""

KERNELS = ("afloat.py", "part.py")

"""Stresses of members, fatigue of their tubular joints, and utilisation, from section loads (F-50 ...)."""

"""Results beyond the paper: recheck time, base points and yaw rate, over many gusts and a year of wind.

``grid`` runs gusts by the thousand, ``limits`` finds the yaw error that a load limit allows, ``year`` counts what a
year of wind brings, ``report`` makes tables and figures of all of it.
"""

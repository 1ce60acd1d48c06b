"""Known deviations from stored runs: beyond their band, understood, each with its own bound.

How each was established stands in docs/verification/index.md.
"""

from __future__ import annotations

from meltemi.verification import known
from meltemi.verification.known import ELASTODYN
from meltemi.verification.table import KnownDeviation

STALE_WIND = (
    "OpenFAST's dynamic inflow takes the wind of one instant for both ends of a step (OpenFAST issue 3447), so the "
    "lead of its filter misses changes of the wind; with the same defect in our filter the deviation falls below 1 % "
    "(tests/verification/test_stale_wind.py)"
)

STALE_GUSTS = (
    "OpenFAST's dynamic inflow takes the wind of one instant for both ends of a step (OpenFAST issue 3447); with the "
    "same defect in our filter nothing deviates by more than 4 % (tests/verification/test_stale_wind.py)"
)
ELASTODYN_EDGE = (
    "ElastoDyn's 17 elements lower the first edgewise frequency by 0.9 %, so that the free vibration of the feathered "
    "blades runs out of phase; with ElastoDyn's frequencies the deviation falls below 2 % "
    "(tests/verification/test_stops.py)"
)
ROTARY_INERTIA = (
    "ElastoDyn's blade sections have no rotary inertia; that of ours turns a pitched blade towards fine pitch, at 25 "
    "m/s with 6.8 kN m as in closed form; without it the deviation is at most 4 %, in turbulence with ElastoDyn's "
    "frequencies 2 % (tests/verification/test_stops.py)"
)
SMALL_YAW = (
    "the third harmonic of a small moment, 12 % of the out-of-plane moment of a blade, is 2.5 % smaller and its mean "
    "20 kN m larger; neither ElastoDyn's frequencies nor its stale wind change that by more than 1 point; not explained"
)
STALLED = (
    "blades in stall vibrate by themselves; ElastoDyn's 17 elements lower the frequency of this vibration by 0.8 to "
    "1.4 %, and so change its phase and growth (table 'parked stall'); with OpenFAST's discretisation in place of ours "
    "the deviation is below 3 % (table 'parked discretisation')"
)
STALL_CYCLE = (
    "dynamic stall limits the edgewise vibration to 0.7 m, and this limit is sensitive: without rotation of the "
    "sections about the span, which ElastoDyn's blades do not have, it is 8 % too small instead of too large, and with "
    "a separation lag 2 ms shorter, a fifth of OpenFAST's time step, amplitude and damping are OpenFAST's "
    "(tests/verification/test_parked_openfast.py)"
)
RELEASE = (
    "what is left of the release at 0 s: ElastoDyn's sums make the turbine 183 kg lighter, 0.4 mm of heave, and the "
    "torque differs by 1 % while the undeflected blades ring; heave and roll, 24 mm and 0.13 deg, hardly decay, and "
    "the side-side moment follows the roll"
)
OUTRUN = (
    "the undeflected blades, let go in 8 m/s, outrun the wind at 10 to 14 m/s; for the reversed flow of half a second "
    "OpenFAST has momentum theory and we Buhl's line (its own loosely coupled run of the rotor on the floater has 14 % "
    "more deflection at 0.7 s), so the tower rings sideways with 10 % less from then on"
)
PASSING = (
    "the release rings, and blades pass the tower: OpenFAST's step of 25 ms lowers a mode from 2.72 to 2.66 Hz, next "
    "to the 21st harmonic of the rotor (of which the water's force has 4.0 kN, with a softer pile and this mode 5.8 to "
    "6.7, OpenFAST 7.1), and from the 9th on the passage is 4 to 5 % weaker, as if blades passed 0.3 m farther from "
    "the tower, which is not explained; the mean of TTDspFA differs by 0.3 mm"
)
SIDEWAYS = (
    "what rings sideways without waves from there: the first mode is 0.05 % higher (with 0.9978 of the tower's "
    "stiffness the phase stays and the correlation is 0.9996) and has 0.02 points less than OpenFAST's 0.66 % of "
    "damping; with OpenFAST's step of 25 ms the moment deviates by 1.00 %; pile and added mass move at 1.3 to 3.4 Hz, "
    "where that step stretches OpenFAST's periods"
)
HEAVE = (
    "OpenFAST's pile is elastic along its axis, ours rigid: tower and pile heave at 8.9 Hz (8.0 Hz with OpenFAST's "
    "step of 25 ms), which raises forces at 1.3 Hz by 2 % and at 2.7 Hz by 9 %; without the inertia of that heave "
    "equivalent loads deviate by -1.2 and 0.0 % (test_offshore.py); in the steel 5 % are 0.01 MPa beside 20 of bending"
)
LINEAR_LOADS = (
    "OpenFAST takes air loads as linear between the nodes, ours act at the nodes; integrated as linear, our loads have "
    "OpenFAST's root moments (tests/verification/test_parked_openfast.py), and with its discretisation the deviation "
    "is below 3 % (table 'parked discretisation')"
)
EQUILIBRIUM = (
    "the rotor stands beside an equilibrium: 0.1 deg of azimuth at the start changes the mean moment by more than it "
    "deviates (tests/verification/test_parked_openfast.py); with OpenFAST's discretisation the deviation is below 3 % "
    "(table 'parked discretisation')"
)
EDGEWISE_RESONANCE = (
    "turbulence excites edgewise vibration, whose frequency ElastoDyn's 17 elements and sums lower by 1 %, so that its "
    "phase differs; with OpenFAST's discretisation of the blades the deviation is below 2 % (same table)"
)
RINGING = (
    "the tower rings in its first mode, with 0.13 % damping, in a sea that excites it: the forces agree within 0.1 %, "
    "the motion differs by 0.8 % of its standard deviation; with half its step OpenFAST is 0.4 % closer"
)
SIDE_RINGING = (
    "the tower rings side-side in its first mode, 1.14 % more than OpenFAST's, with steps of 2.5 and 12.5 ms, explicit "
    "and implicit: converged; in waves half of its step brings OpenFAST 0.4 % closer, in turbulence not tried"
)

KNOWN: tuple[KnownDeviation, ...] = (
    *known.KNOWN,
    KnownDeviation("offshore turbulence", "TTDspSS std", "M5_12", 1.2, SIDE_RINGING),
    KnownDeviation("offshore turbulence", "ReactMXss std", "M5_12", 1.2, SIDE_RINGING),
    KnownDeviation("offshore waves", "ReactMYss std", "M3*", 1.0, RINGING),
    KnownDeviation("offshore waves", "M?N1MKye std", "M3*", 1.0, RINGING),
    KnownDeviation("offshore waves", "TwrBs* std", "M3*", 1.0, RINGING),
    KnownDeviation("offshore waves", "TwrBsFxt correlation", "M3*", 0.1, RINGING),
    KnownDeviation("offshore waves", "TTDspFA std", "M3*", 1.0, RINGING),
    KnownDeviation("turbulence *", "OoPDefl1 mean", "*", 3.0, ELASTODYN),
    KnownDeviation("turbulence *", "IPDefl1 mean", "*", 3.0, ELASTODYN),
    KnownDeviation("gust", "* minimum", "set B", 5.0, STALE_WIND),
    KnownDeviation("gust", "* maximum", "set B", 5.0, STALE_WIND),
    KnownDeviation("gust", "GenPwr time of minimum", "set B", 0.5, STALE_WIND),
    KnownDeviation("gusts", "RootMzc1", "*", 7.0, ROTARY_INERTIA),
    KnownDeviation("stops", "RootMzc1", "*", 6.0, ROTARY_INERTIA),
    KnownDeviation("stops in turbulence", "RootMzc1", "*", 12.0, ROTARY_INERTIA),
    KnownDeviation("stops in turbulence", "time of extreme", "*, RootMzc1 maximum", 1.5, ROTARY_INERTIA),
    KnownDeviation("gusts", "RtFldMxh", "*", 14.0, STALE_GUSTS),
    KnownDeviation("gusts", "YawBrMxp", "*", 14.0, STALE_GUSTS),
    KnownDeviation("gusts", "time of extreme", "ewsh_n_12, *", 7.0, STALE_GUSTS),
    KnownDeviation("gusts", "YawBrMzp", "eog_25, *imum before", 4.0, SMALL_YAW),
    KnownDeviation("gusts", "LSSTipMzs", "eog_25, *imum before", 4.0, SMALL_YAW),
    KnownDeviation("gusts", "YawBrMzp", "*", 12.0, STALE_GUSTS),
    KnownDeviation("gusts", "LSSTipMzs", "*", 12.0, STALE_GUSTS),
    KnownDeviation("gusts", "LSSTipMys", "*", 9.0, STALE_GUSTS),
    KnownDeviation("gusts", "YawBrMyp", "*", 9.0, STALE_GUSTS),
    KnownDeviation("gusts", "TTDspFA", "*", 9.0, STALE_GUSTS),
    KnownDeviation("gusts", "TwrBsMyt", "*", 6.0, STALE_GUSTS),
    KnownDeviation("stops", "YawBrMzp", "normalstop_12, *", 8.0, STALE_GUSTS),
    KnownDeviation("stops", "LSSTipMzs", "normalstop_12, *", 6.0, STALE_GUSTS),
    KnownDeviation("stops in turbulence", "YawBrMzp", "*", 7.0, ELASTODYN_EDGE),
    KnownDeviation("stops in turbulence", "LSSTipMzs", "*", 7.0, ELASTODYN_EDGE),
    KnownDeviation("wind step", "GenPwr largest of a revolution", "set B", 3.0, STALE_WIND),
    KnownDeviation("parked", "*", "idling 42.5 m/s +30 deg: *", 6.5, STALLED),
    KnownDeviation("parked", "*", "idling 42.5 m/s +30 deg, nacelle turned: *", 5.0, STALLED),
    KnownDeviation("parked", "*", "idling 59.5 m/s -15 deg: *", 5.5, STALLED),
    KnownDeviation("parked", "*", "locked 42.5 m/s +30 deg at 0 deg: *", 10.6, STALLED),
    KnownDeviation("parked", "*", "locked 42.5 m/s +30 deg at 30 deg: *", 13.6, STALLED),
    KnownDeviation("parked", "*", "idling 59.5 m/s -15 deg, dynamic stall: *", 5.2, STALLED),
    KnownDeviation("parked", "RootMzc1", "*", 15.0, LINEAR_LOADS),
    KnownDeviation("parked", "YawBrMzp", "idling 42.5 m/s 0 deg*", 5.6, LINEAR_LOADS),
    KnownDeviation("parked", "LSSTipMzs", "idling 42.5 m/s 0 deg*", 3.7, LINEAR_LOADS),
    KnownDeviation("parked", "*", "one blade at 0 deg 25 m/s: *", 10.6, EQUILIBRIUM),
    KnownDeviation("parked discretisation", "*", "idling 59.5 m/s -15 deg, dynamic stall: *", 4.7, STALL_CYCLE),
    KnownDeviation("parked stall", "last amplitude", "locked 42.5 m/s +30 deg at 0 deg", 10.0, STALLED),
    KnownDeviation("parked stall", "last amplitude", "idling 59.5 m/s -15 deg, dynamic stall*", 8.2, STALL_CYCLE),
    KnownDeviation("parked turbulence*", "*", "idling in turbulence * deg: *", 11.2, EDGEWISE_RESONANCE),
    KnownDeviation("parked turbulence*", "*", "idling in turbulence * deg, 30 s: *", 8.2, EDGEWISE_RESONANCE),
    KnownDeviation("offshore wind", "*", "M4_8", 14.0, OUTRUN),
    KnownDeviation("offshore wind", "TwrBsFxt *", "M4_1?", 4.0, PASSING),
    KnownDeviation("offshore wind", "ReactFXss *", "M4_1?", 8.5, PASSING),
    KnownDeviation("offshore wind", "*", "M4_1?", 3.0, PASSING),
    KnownDeviation("offshore turbulence", "TwrBsMxt std", "M5_12", 1.5, SIDEWAYS),
    KnownDeviation("offshore turbulence", "HydroFyi *", "M5_12", 8.0, SIDEWAYS),
    KnownDeviation("offshore turbulence", "TwrBsFzt *", "M5_*", 6.0, HEAVE),
    KnownDeviation("offshore turbulence", "ReactFYss correlation", "M5_12", 2.0, SIDEWAYS),
    KnownDeviation("floating wind", "PtfmHeave std", "F5_8", 3.5, RELEASE),
    KnownDeviation("floating wind", "PtfmRoll std", "F5_8", 3.0, RELEASE),
    KnownDeviation("floating wind", "TwrBsMxt std", "F5_8", 3.0, RELEASE),
    KnownDeviation("periodic *", "OoPDefl1 mean", "*", 4.0, ELASTODYN),
    KnownDeviation("spin", "*", "OoPDefl1", 3.5, ELASTODYN),
    KnownDeviation("spin", "*", "IPDefl1", 3.5, ELASTODYN),
    KnownDeviation("periodic B", "OoPDefl1 amplitude", "shear_12", 6.0, STALE_WIND),
)
"""Those of ``meltemi verify`` among them."""

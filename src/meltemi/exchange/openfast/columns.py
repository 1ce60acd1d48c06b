"""Order of the columns of OpenFAST's tables, as its modules read them regardless of the header.

HydroDyn_Input.f90, SubDyn.f90, ElastoDyn_IO.f90 (``ReadTowerFile``), AeroDyn_IO.f90, BeamDyn_IO.f90 and MoorDyn.f90 of
OpenFAST 5.0.0; later columns are not read here. The first columns are unchanged since version 2, except those of
HydroDyn's members.
"""

from __future__ import annotations

AXIAL = "AxCoefID AxCd AxCa AxCp"
HYDRO_JOINTS = "JointID Jointxi Jointyi Jointzi JointAxID"
HYDRO_SECTIONS = "PropSetID PropD PropThck"
SIMPLE = "SimplCd SimplCdMG SimplCa SimplCaMG SimplCp"
BY_DEPTH = "Dpth DpthCd DpthCdMG DpthCa DpthCaMG DpthCp"
BY_MEMBER = "MemberID " + " ".join(f"Member{c}{k}" for c in ("Cd", "CdMG", "Ca", "CaMG", "Cp") for k in (1, 2))
GROWTH = "MGDpth MGThck MGDens"
_ENDS = "MemberID MJointID1 MJointID2 MPropSetID1 MPropSetID2"
MEMBERS = {
    7: f"{_ENDS} MDivSize MCoefMod|CoefMod PropPot",
    8: f"{_ENDS} MDivSize MCoefMod|CoefMod MHstLMod PropPot",
    10: f"{_ENDS} MSecGeom MSpinOrient MDivSize MCoefMod|CoefMod MHstLMod PropPot",
}
"""Columns of OpenFAST 2, of 3 and 4, and of 5, by the index of ``PropPot``, the only True or False of the row."""
SUB_JOINTS = "JointID JointXss JointYss JointZss"
SUB_MEMBERS = _ENDS
SUB_SECTIONS = "PropSetID YoungE ShearG MatDens XsecD XsecT"
SUB_MASSES = "CMJointID JMass JMXX JMYY JMZZ"
TOWER = "HtFract TMassDen TwFAStif TwSSStif"
TOWER_AIR = "TwrElev TwrDiam TwrCd"
KEY_POINTS = "kp_xr kp_yr kp_zr initial_twist"

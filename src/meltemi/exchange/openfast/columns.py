"""Order of the columns of OpenFAST's tables, as its modules read them regardless of the header.

HydroDyn_Input.f90, SubDyn.f90, ElastoDyn_IO.f90 (``ReadTowerFile``), AeroDyn_IO.f90, BeamDyn_IO.f90 and MoorDyn.f90 of
OpenFAST 5.0.0; later columns are not read here. The first columns are unchanged since version 2, except those of
HydroDyn's members.
"""

from __future__ import annotations

AXIAL = "AxCoefID AxCd AxCa AxCp"
HYDRO_JOINTS = "JointID Jointxi Jointyi Jointzi JointAxID"
HYDRO_SECTIONS = "PropSetID PropD PropThck"
HYDRO_RECTANGLES = "PropSetID PropA PropB PropThck"
_ROUND, _RECTANGLE = "Cd Ca Cp AxCd AxCa AxCp Cb", "CdA CdB CaA CaB Cp AxCd AxCa AxCp Cb"


def _coefficients(prefix: str, names: str, ends: str = "") -> str:
    """Columns of coefficients, each also under marine growth, and at both ends of a member."""
    return " ".join(f"{prefix}{c}{g}{k}" for c in names.split() for g in ("", "MG") for k in ends or ("",))


SIMPLE, SIMPLE_REC = (_coefficients("Simpl", names) for names in (_ROUND, _RECTANGLE))
BY_DEPTH, BY_DEPTH_REC = ("Dpth " + _coefficients("Dpth", names) for names in (_ROUND, _RECTANGLE))
BY_MEMBER, BY_MEMBER_REC = ("MemberID " + _coefficients("Member", names, "12") for names in (_ROUND, _RECTANGLE))
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

"""Figures 1, 15 and 16, which are block diagrams: drawn as this package has the system."""

from __future__ import annotations

from typing import TYPE_CHECKING

from meltemi_papers.block_diagram import Block, Frame, Wire, plot_blocks

if TYPE_CHECKING:
    from matplotlib.figure import Figure


FONT = 9.5


def system() -> Figure:
    """Figure 1: from the environment to the grid."""
    blocks = {
        "air": Block("air: $T$, $H_r$, $h_s$, $p$", (0.9, 3.6), (1.8, 0.55), "outside"),
        "rain": Block("rain: $I$, $d$", (0.9, 2.85), (1.8, 0.55), "outside"),
        "ice": Block("ice: mass, roughness", (0.9, 2.1), (1.8, 0.55), "outside"),
        "wind": Block("wind: $V_w$, direction", (0.9, 1.35), (1.8, 0.55), "outside"),
        "rotor": Block("rotor\n$C_p(\\lambda, \\beta)$ or\nmoving blades", (3.1, 2.1), (1.5, 1.0)),
        "shaft": Block("drive train\n$J$, $B_m$", (4.9, 2.1), (1.2, 0.75)),
        "machine": Block("PMSG\n$p$, $\\Psi_m$, $R_s$, $L_s$", (6.65, 2.1), (1.5, 0.75)),
        "rectifier": Block("machine-side\nconverter", (8.45, 2.1), (1.3, 0.75)),
        "link": Block("DC link\n$C$, chopper", (10.05, 2.1), (1.15, 0.75)),
        "inverter": Block("grid-side\nconverter", (11.6, 2.1), (1.15, 0.75)),
        "filter": Block("filter\n$R_g$, $L_g$", (13.0, 2.1), (0.95, 0.75)),
        "grid": Block("grid\n$V_g$, $f_g$, $P_{ref}$", (14.55, 2.1), (1.35, 0.75), "outside"),
        "pitch": Block("pitch: collective,\nindividual", (3.1, 0.45), (1.75, 0.65), "control"),
        "yaw": Block("yaw: dead band,\nrate", (1.0, 0.45), (1.6, 0.65), "control"),
        "torque": Block("torque: optimal, tracking,\npower schemes A0 to A3", (6.2, 0.45), (2.3, 0.65), "control"),
        "current": Block("current control\n$i_d^* = 0$, $i_q^*$", (9.0, 0.45), (1.6, 0.65), "control"),
        "voltage": Block("DC voltage,\nreactive power", (11.6, 0.45), (1.5, 0.65), "control"),
    }
    wires = [
        Wire("air.right", "rotor.top-0.4", "$\\rho$", via=((2.7, 3.6),), place=0.3),
        Wire("rain.right", "rotor.left+0.25", "loss", via=((2.1, 2.85), (2.1, 2.35)), place=0.18),
        Wire("ice.right", "rotor.left"),
        Wire("wind.right", "rotor.left-0.25", via=((2.1, 1.35), (2.1, 1.85))),
        Wire("rotor.right", "shaft.left", "$T_a$"),
        Wire("shaft.right", "machine.left", "$\\omega_m$"),
        Wire("machine.right", "rectifier.left", "$v, i$"),
        Wire("rectifier.right", "link.left"),
        Wire("link.right", "inverter.left", "$V_{dc}$"),
        Wire("inverter.right", "filter.left"),
        Wire("filter.right", "grid.left", "$P, Q$"),
        Wire("pitch.top", "rotor.bottom", "$\\beta$", place=0.6),
        Wire("yaw.top", "wind.bottom+0.1", "direction", place=0.45),
        Wire("shaft.bottom-0.25", "pitch.right", "$\\omega_m$", via=((4.65, 0.45),), place=0.4),
        Wire((4.65, 0.45), "torque.left"),
        Wire("torque.right", "current.left", "$T_{em}^*$"),
        Wire("current.top-0.55", "rectifier.bottom", "$v_{dq}$", place=0.6),
        Wire("voltage.top", "inverter.bottom", "$v_{dq}$", place=0.6),
        Wire(
            "grid.top",
            "torque.bottom",
            "$P_{ref}$, $f_g$",
            via=((14.55, 2.85), (15.5, 2.85), (15.5, -0.15), (6.2, -0.15)),
            place=0.7,
        ),
    ]
    return plot_blocks(blocks, wires, font=FONT)


def climate() -> Figure:
    """Figure 15: from temperature, humidity, altitude and rain to power."""
    blocks = {
        "t": Block("temperature $T$", (0.8, 3.3), (1.5, 0.5), "outside"),
        "h": Block("humidity $H_r$", (0.8, 2.6), (1.5, 0.5), "outside"),
        "z": Block("altitude $h_s$, $p_0$", (0.8, 1.9), (1.5, 0.5), "outside"),
        "i": Block("rain rate $I$", (0.8, 1.0), (1.5, 0.5), "outside"),
        "d": Block("drop size $d$", (0.8, 0.3), (1.5, 0.5), "outside"),
        "v": Block("wind $V_w$", (0.8, -0.4), (1.5, 0.5), "outside"),
        "pv": Block("vapour pressure\n$p_v$ (3)", (3.0, 2.95), (1.5, 0.6)),
        "ph": Block("pressure $p_h$ (4)\n$p_d = p_h - p_v$", (3.0, 1.9), (1.5, 0.6)),
        "rho": Block("air density\n$\\rho$ (2)", (5.2, 2.45), (1.4, 0.6)),
        "n": Block("drops in the air\n$\\Lambda$, $n(d)$, $N$ (9, 10)", (3.2, 0.65), (1.9, 0.62)),
        "w": Block("wetted area\n$W(V_w)$ (12)", (3.2, -0.4), (1.9, 0.6)),
        "f": Block("rain force\n$F_d$ (5) to (11)", (5.6, 0.65), (1.6, 0.62)),
        "pa": Block("$P_a = \\frac{1}{2}\\rho\\pi R^2 C_p V_w^3$ (1)", (7.75, 2.45), (2.2, 0.6)),
        "cp": Block("rotor $C_p(\\lambda, \\beta)$", (7.75, 3.85), (1.7, 0.5)),
        "loss": Block("rain loss\n$F_d V_w$", (7.75, 0.65), (1.4, 0.6)),
        "sum": Block("$P = P_a - F_d V_w$,\nnot below 0 (14)", (10.2, 1.6), (1.9, 0.65)),
        "k": Block("torque law $K_T(\\rho)$\n(15), (16)", (10.2, 3.2), (1.9, 0.62), "control"),
        "out": Block("drive train and\ngenerator: $P_{em}$", (12.5, 1.6), (1.6, 0.65)),
    }
    wires = [
        Wire("t.right", "pv.left+0.15", via=((1.95, 3.3), (1.95, 3.1))),
        Wire("h.right", "pv.left-0.15", via=((1.95, 2.6), (1.95, 2.8))),
        Wire("z.right", "ph.left"),
        Wire("pv.right", "rho.left+0.15", "$p_v$", via=((4.1, 2.95), (4.1, 2.6)), place=0.15),
        Wire("ph.right", "rho.left-0.15", "$p_d$", via=((4.1, 1.9), (4.1, 2.3)), place=0.15),
        Wire("t.top", "rho.top", "$T$", via=((0.8, 3.85), (5.2, 3.85)), place=0.35),
        Wire("i.right", "n.left+0.15", via=((1.9, 1.0), (1.9, 0.8))),
        Wire("d.right", "n.left-0.15", via=((1.9, 0.3), (1.9, 0.5))),
        Wire("v.right", "w.left"),
        Wire("n.right", "f.left", "$N d^3$"),
        Wire("w.right", "f.bottom", "$W$", via=((5.6, -0.4),), place=0.3),
        Wire("rho.right", "pa.left", "$\\rho$"),
        Wire("cp.bottom", "pa.top", "$C_p$", place=0.22),
        Wire("f.right", "loss.left", "$F_d$"),
        Wire("v.bottom", "loss.bottom", "$V_w$", via=((0.8, -0.95), (7.75, -0.95)), place=0.45),
        Wire((7.75, -0.95), "pa.right", via=((9.05, -0.95), (9.05, 2.45))),
        Wire("pa.bottom", "sum.left+0.15", "$P_a$", via=((7.75, 1.75),), place=0.25),
        Wire("loss.top", "sum.left-0.15", "$-$", via=((7.75, 1.45),), place=0.7, above=False),
        Wire((6.2, 2.45), "k.left", via=((6.2, 3.2),)),
        Wire("sum.right", "out.left", "$P$"),
        Wire("k.right", "out.top", "$T_{em}^*$", via=((12.5, 3.2),), place=0.75),
    ]
    return plot_blocks(blocks, wires, font=FONT)


def coordination_parts() -> tuple[dict[str, Block], list[Wire]]:
    """Blocks and wires of Figure 16."""
    blocks = {
        "air": Block("air $T$, $H_r$, $h_s$\n$\\to \\rho$", (0.8, 4.1), (1.4, 0.62), "outside"),
        "wind": Block("wind $V_w$,\ndirection", (0.8, 3.1), (1.4, 0.62), "outside"),
        "rotor": Block("rotor\n$C_p(\\lambda, \\beta)$", (3.4, 3.6), (1.4, 0.75)),
        "shaft": Block("drive train\n$J\\dot\\omega = T_a - T_{em} - B_m\\omega$", (6.2, 3.6), (2.3, 0.75)),
        "machine": Block("PMSG and\nmachine-side converter", (9.3, 3.6), (1.9, 0.75)),
        "gridside": Block("DC link, grid-side\nconverter, filter", (11.8, 3.6), (1.7, 0.75)),
        "grid": Block("grid", (13.75, 3.6), (0.9, 0.62), "outside"),
        "drive": Block("yaw drive\nrate limit", (0.8, 1.6), (1.4, 0.62)),
        "actuator": Block("pitch actuator\n8 deg/s, 0 to 25 deg", (3.4, 1.6), (1.9, 0.62)),
        "yaw": Block("yaw law\nfilter, dead band", (0.8, 0.3), (1.5, 0.62), "control"),
        "ipc": Block("individual pitch\n(optional)", (2.75, 0.3), (1.35, 0.62), "control"),
        "pitch": Block("pitch law\nPI scheduled", (4.5, 0.3), (1.35, 0.62), "control"),
        "scheme": Block("active power scheme\n$\\omega_l$, $\\omega_u$, hold", (6.9, 0.3), (1.9, 0.62), "control"),
        "torque": Block("torque law\n$K_T\\omega^2$ or $P_{ref}/\\omega$", (9.3, 0.3), (1.75, 0.62), "control"),
        "current": Block("current control\n$i_q^* = 2T_{em}^*/(3p\\Psi_m)$", (9.3, 1.6), (1.9, 0.62), "control"),
        "order": Block("power reference,\ndroop on $f_g$", (11.9, 0.3), (1.6, 0.62), "control"),
    }
    wires = [
        Wire("air.right", "rotor.left+0.15", via=((2.1, 4.1), (2.1, 3.75))),
        Wire("wind.right", "rotor.left-0.15", via=((2.1, 3.1), (2.1, 3.45))),
        Wire("rotor.right", "shaft.left", "$T_a$"),
        Wire("machine.left", "shaft.right", "$T_{em}$"),
        Wire("machine.right", "gridside.left", "$P_{em}$"),
        Wire("gridside.right", "grid.left", "$P, Q$"),
        Wire("drive.top", "wind.bottom", "direction of\nthe nacelle", place=0.5),
        Wire("wind.left", "yaw.left", "vane", via=((-0.25, 3.1), (-0.25, 0.3)), place=0.3),
        Wire("actuator.top", "rotor.bottom", "$\\beta$"),
        Wire("yaw.top", "drive.bottom", "rate", place=0.7),
        Wire("rotor.bottom-0.5", "ipc.left", "root\nmoments", via=((2.9, 2.65), (1.85, 2.65), (1.85, 0.3)), place=0.45),
        Wire("ipc.top", "actuator.bottom-0.4", via=((2.75, 0.95), (3.0, 0.95))),
        Wire("pitch.top", "actuator.bottom+0.4", "$\\beta^*$", via=((4.5, 0.95), (3.8, 0.95)), place=0.5),
        Wire("scheme.left", "pitch.right", "$\\omega_u$"),
        Wire("scheme.right", "torque.left", "$\\omega_l$"),
        Wire("torque.top", "current.bottom", "$T_{em}^*$"),
        Wire("current.top", "machine.bottom", "$v_{dq}$"),
        Wire("order.left", "torque.right", "$P_{ref}$"),
        Wire("shaft.bottom", "scheme.top", "$\\omega_m$", via=((6.2, 2.3), (6.9, 2.3)), place=0.55),
        Wire((6.9, 1.0), "pitch.top+0.4", via=((4.9, 1.0),)),
        Wire((6.9, 1.0), "torque.top-0.6", via=((8.7, 1.0),)),
        Wire("grid.bottom", "order.right", "$P_{ref}$, $f_g$", via=((13.75, 0.3),), place=0.35),
        Wire("order.bottom", "scheme.bottom", via=((11.9, -0.3), (6.9, -0.3))),
        Wire("scheme.bottom-0.4", "yaw.bottom", "power to spare widens the dead band", via=((6.5, -0.3), (0.8, -0.3))),
    ]
    return blocks, wires


def coordination() -> Figure:
    """Figure 16: pitch, torque and yaw with one power reference."""
    blocks, wires = coordination_parts()
    return plot_blocks(blocks, wires, [Frame("coordinated controller", (-0.45, -0.65), (12.85, 0.78))], font=FONT)

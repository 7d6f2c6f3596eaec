"""The exact solutions of `xcrack.verification` as tests call them: `exact.penny`, `exact.BOWIE`.

No formula is here; what a test needs more comes from `xcrack.verification` itself.
"""

from xcrack.verification import fields_2d
from xcrack.verification.arcs import ArcCrack, arc_manufactured
from xcrack.verification.closed import (
    centre_open,
    centre_open_opening,
    centre_open_pressure,
    closed_crack,
    partial_closure,
    partial_closure_opening,
    partial_closure_params,
    partial_closure_pressure,
)
from xcrack.verification.fields_2d import (
    griffith,
    inclined_remote,
    periodic,
    periodic_K,
    slip_patch,
)
from xcrack.verification.fields_3d import crack_displacement as crack_disp3
from xcrack.verification.fields_3d import ellipse_coeffs, ellipse_K, penny, penny_K
from xcrack.verification.fields_3d import ellipse_displacement as ellipse_disp
from xcrack.verification.fields_3d import uniform_stress_3d as uniform_stress3
from xcrack.verification.holes import kirsch, lame_cylinder
from xcrack.verification.kinks import equivalent_K as k_eq
from xcrack.verification.kinks import hoop_angle
from xcrack.verification.lives import elber_share as elber_U
from xcrack.verification.lives import paris_life
from xcrack.verification.plates import BOWIE, newman_raju_corner, newman_raju_surface
from xcrack.verification.plates import PLATE_CENTRE as CCT_LS
from xcrack.verification.plates import PLATE_EDGE as SENT_LS
from xcrack.verification.potentials_2d import complex_points as _z
from xcrack.verification.potentials_2d import cut_root as csqrt2
from xcrack.verification.potentials_2d import potential_field as km_field
from xcrack.verification.potentials_2d import uniform_stress, westergaard_field


def williams(x, y, E, nu, KI=0.0, KII=0.0, *rest, **options):
    """`fields_2d.williams`, whose K_I and K_II tests name without the underscore."""
    return fields_2d.williams(x, y, E, nu, KI, KII, *rest, **options)

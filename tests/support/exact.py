"""Exact solutions of `xcrack.verification.exact` as tests call them: `exact.penny`.

No formula is here; what a test needs more comes from `xcrack.verification.exact` itself.
"""

from xcrack.verification.exact import fields_2d
from xcrack.verification.exact.arcs import ArcCrack, arc_manufactured
from xcrack.verification.exact.closed import (
    centre_open,
    centre_open_opening,
    centre_open_pressure,
    closed_crack,
    partial_closure,
    partial_closure_opening,
    partial_closure_params,
    partial_closure_pressure,
)
from xcrack.verification.exact.fields_2d import (
    griffith,
    inclined_remote,
    periodic,
    periodic_K,
    slip_patch,
)
from xcrack.verification.exact.fields_3d import crack_displacement as crack_disp3
from xcrack.verification.exact.fields_3d import ellipse_coeffs, ellipse_K, penny, penny_K
from xcrack.verification.exact.fields_3d import ellipse_displacement as ellipse_disp
from xcrack.verification.exact.fields_3d import uniform_stress_3d as uniform_stress3
from xcrack.verification.exact.kinks import equivalent_K as k_eq
from xcrack.verification.exact.kinks import hoop_angle
from xcrack.verification.exact.lives import elber_share as elber_U
from xcrack.verification.exact.lives import paris_life
from xcrack.verification.exact.plates import (
    BOWIE,
    kirsch,
    lame_cylinder,
    newman_raju_corner,
    newman_raju_surface,
)
from xcrack.verification.exact.plates import PLATE_CENTRE as CCT_LS
from xcrack.verification.exact.plates import PLATE_EDGE as SENT_LS
from xcrack.verification.exact.potentials_2d import complex_points as _z
from xcrack.verification.exact.potentials_2d import cut_root as csqrt2
from xcrack.verification.exact.potentials_2d import potential_field as km_field
from xcrack.verification.exact.potentials_2d import uniform_stress, westergaard_field


def williams(x, y, E, nu, KI=0.0, KII=0.0, *rest, **options):
    """`fields_2d.williams`, whose K_I and K_II tests name without the underscore."""
    return fields_2d.williams(x, y, E, nu, KI, KII, *rest, **options)

"""Methods that xcrack does not use, to compare it with: `Numerics` takes them as values.

from xcrack.verification import methods
xc.Numerics(contact_method=methods.penalty())
xc.Numerics(tip_basis=methods.modal_basis(), level_sets=methods.nodal_level_sets())
"""

from xcrack.verification.methods.contact import augmented_lagrangian, nitsche, penalty
from xcrack.verification.methods.inf_sup import inf_sup
from xcrack.verification.methods.level_sets import nodal_level_sets
from xcrack.verification.methods.tip_basis import modal_basis

__all__ = [
    "augmented_lagrangian",
    "inf_sup",
    "modal_basis",
    "nitsche",
    "nodal_level_sets",
    "penalty",
]

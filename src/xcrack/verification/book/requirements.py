"""What xcrack is to be trusted with: the rows of the matrix, those without a case among them."""

from collections.abc import Mapping
from types import MappingProxyType

REQUIREMENTS: Mapping[str, str] = MappingProxyType({
    "K": "K_I and K_II of straight cracks, both tips, both signs",
    "K_curved": "K of curved cracks",
    "K_tables": "K in finite bodies",
    "K_hole": "K of cracks from holes",
    "K_fronts": "K_I, K_II and K_III along fronts",
    "K_surface": "K of surface and corner cracks",
    "T": "T-stress",
    "loads": "K under pressure on the crack faces, body forces and initial stress",
    "energy": "Displacements and stresses converge at the rate of the elements",
    "patch": "A uniform pressure across closed faces comes out exactly",
    "pressure": "Contact pressure of closed cracks converges without oscillation",
    "partial": "Partly closed cracks: K, and where contact ends",
    "sliding": "Closed cracks slide without friction: K_I = 0, and K_II",
    "stability": "The multipliers are stable: inf-sup constant",
    "junctions": "K of cracks that end on others",
    "cut": "Results do not depend on where a crack cuts the cells",
    "invariance": "Results do not depend on units, position and direction",
    "direction": "Angle at which a crack turns",
    "path": "Path of a growing crack",
    "fronts": "Shape of a growing front",
    "joins": "Cracks that join: cycles, and K of the crack that goes on",
    "life": "Cycles under constant amplitude",
    "ratio": "Cycles where the stress ratio or closure matters",
    "restart": "A run that was stopped goes on to the same result",
    "spectrum": "Cycles under variable amplitude and overloads",
    "scatter": "Lives with scatter, and chances that inspections miss",
    "opening": "Opening of crack mouths",
    "friction": "Faces that rub: stick, slip along a path of loads, energy of a cycle",
    "error_bars": "Error bars of K and of lives hold the truth",
    "residual_strength": "Residual strength: toughness and net section",
    "temperature": "Thermal stress",
    "resultants": "Resultants of bearing loads, forces and moments, and reactions",
    "measures": "Depth, lengths on surfaces and area of a crack in a body",
    "materials": "Several materials, graded ones, and cracks beside and on interfaces",
    "submodel": "K of a part whose cut sides move as the whole does",
})  # fmt: skip


__all__ = ["REQUIREMENTS"]

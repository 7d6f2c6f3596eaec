"""xcrack: fatigue crack growth by extended finite elements, with contact of the crack faces.

Importing it loads neither gmsh, pyvista, meshio, matplotlib nor numba; each is loaded where it
is first used.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_HOME = {
    "Mesh": "mesh.mesh",
    "box": "mesh.box",
    "read_mesh": "mesh.files",
    "mesh_step": "mesh.step",
    "write_mesh": "mesh.files",
    "plate": "mesh.plates",
    "plate_with_hole": "mesh.plates",
    "notched_cylinder": "mesh.cylinder",
    "refine": "mesh.refinement",
    "Isotropic": "scene.material",
    "Crack": "crack.crack",
    "line_crack": "crack.lines",
    "penny_crack": "crack.surfaces",
    "elliptic_crack": "crack.surfaces",
    "plane_crack": "crack.surfaces",
    "surface_crack": "crack.surfaces",
    "read_surface": "crack.surfaces",
    "measures": "crack.measures",
    "fix": "scene.conditions",
    "displacement": "scene.conditions",
    "traction": "scene.conditions",
    "pressure": "scene.conditions",
    "point_force": "scene.conditions",
    "body_force": "scene.conditions",
    "crack_pressure": "scene.conditions",
    "initial_stress": "scene.conditions",
    "bearing": "scene.set_loads",
    "resultant": "scene.set_loads",
    "temperature": "scene.temperature",
    "read_field": "mesh.fields",
    "Problem": "scene.problem",
    "Numerics": "scene.numerics",
    "Comparison": "scene.numerics",
    "solve": "analysis.solve",
    "Solution": "analysis.solution",
    "pardiso": "solvers.direct",
    "energy_error": "post.norms",
    "stress_intensity": "sif.stress_intensity",
    "stress_intensities": "sif.stress_intensity",
    "SIF": "sif.sif",
    "max_hoop_stress": "growth.criteria",
    "mean_reference": "growth.criteria",
    "weighted_angle": "growth.criteria",
    "equivalent_K": "growth.criteria",
    "paris": "laws.power",
    "elber": "laws.power",
    "walker": "laws.power",
    "piecewise": "laws.power",
    "forman": "laws.fracture",
    "hartman_schijve": "laws.fracture",
    "nasgro": "laws.fracture",
    "nasgro_K_c": "laws.fracture",
    "rate_table": "laws.tables",
    "law": "laws.presets",
    "presets": "laws.presets",
    "linear_closure": "laws.closures",
    "schijve_closure": "laws.closures",
    "newman_closure": "laws.closures",
    "klesnil_lukas": "laws.thresholds",
    "stepped_threshold": "laws.thresholds",
    "el_haddad": "laws.thresholds",
    "nasgro3_threshold": "laws.thresholds",
    "nasgro4_threshold": "laws.thresholds",
    "cycles_between": "growth.cycles",
    "Spectrum": "spectra.spectrum",
    "rainflow": "spectra.rainflow",
    "read_spectrum": "spectra.files",
    "twist": "spectra.twist",
    "Cycle": "growth.step",
    "Step": "growth.step",
    "grow": "growth.run",
    "life": "lives.life",
    "Scatter": "lives.scatter",
    "lognormal": "lives.scatter",
    "normal": "lives.scatter",
    "growth_curve": "lives.inspection",
    "inspection": "lives.inspection",
    "logistic_pod": "lives.inspection",
    "History": "history.history",
    "collect": "history.collect",
    "resume": "history.collect",
    "load": "history.collect",
    "save": "history.saved",
    "write": "post.vtk",
    "plot": "plotting.plot",
    "draw_fronts": "plotting.fronts_3d",
    "draw_K": "plotting.fronts_3d",
    "inf_sup": "contact.inf_sup",
    "plan": "analysis.plan",
    "chart": "charting.chart",
    "verify": "book.verify",
    "report": "reporting.report",
    "read_case": "casefile.case",
    "run": "casefile.run",
    "info": "command.info",
    "demo": "command.demo",
    "convert_mesh": "command.convert",
    "XcrackError": "errors",
    "XcrackWarning": "errors",
    "MeshError": "errors",
    "GeometryError": "errors",
    "ProblemError": "errors",
    "ConvergenceError": "errors",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"xcrack.{_HOME[name]}"), name)
    raise AttributeError(f"module 'xcrack' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]

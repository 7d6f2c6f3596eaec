"""xcrack: fatigue crack growth by extended finite elements, with contact of the lips.

Importing it loads neither gmsh, pyvista, meshio, matplotlib nor numba; each is loaded where it
is first used.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_HOME = {
    "Mesh": "mesh",
    "box": "structured",
    "read_mesh": "mesh_io",
    "write_mesh": "mesh_io",
    "plate": "meshes",
    "plate_with_hole": "meshes",
    "notched_cylinder": "cylinder",
    "refine": "refinement",
    "Isotropic": "material",
    "Crack": "crack",
    "line_crack": "crack",
    "penny_crack": "surface",
    "elliptic_crack": "surface",
    "plane_crack": "surface",
    "surface_crack": "surface",
    "read_surface": "surface",
    "fix": "conditions",
    "displacement": "conditions",
    "traction": "conditions",
    "pressure": "conditions",
    "point_force": "conditions",
    "body_force": "conditions",
    "crack_pressure": "conditions",
    "initial_stress": "conditions",
    "Problem": "problem",
    "Numerics": "numerics",
    "solve": "solving",
    "Solution": "solution",
    "pardiso": "linear",
    "energy_error": "norms",
    "stress_intensity": "interaction",
    "stress_intensities": "interaction",
    "SIF": "sif",
    "max_hoop_stress": "criteria",
    "mean_reference": "criteria",
    "weighted_angle": "criteria",
    "equivalent_K": "criteria",
    "paris": "laws",
    "elber": "laws",
    "walker": "laws",
    "cycles_between": "cycles",
    "Cycle": "growth",
    "Step": "growth",
    "grow": "growth",
    "History": "history",
    "collect": "history",
    "resume": "history",
    "load": "history",
    "write": "export",
    "plot": "plotting",
    "draw_fronts": "plot_fronts",
    "draw_K": "plot_fronts",
    "inf_sup": "infsup",
    "plan": "planning",
    "chart": "charting",
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

"""What `import xcrack as xc` offers: this list and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

import xcrack

NAMES = [
    # scene
    "Crack", "Graded", "Isotropic", "MaterialSets", "Mesh", "Numerics", "Problem",
    "body_force", "box", "crack_pressure", "displacement", "fix", "initial_stress",
    "line_crack", "line_force", "fit_curves",
    "penny_crack", "elliptic_crack", "plane_crack", "surface_crack", "read_surface", "arm",
    "notched_cylinder", "part", "plate", "plate_with_hole", "point_force", "pressure", "read_mesh",
    "mesh_step", "read_field", "read_deck", "Deck", "bearing", "resultant", "temperature",
    "measures",
    "traction", "write_mesh",
    # solution
    "Solution", "adapt", "chart", "energy_error", "inf_sup", "plan", "plot", "solve",
    "stress_intensity",
    "write", "SIF", "handbook", "Specimen",
    "compact_tension", "disc_compact", "lug", "middle_tension", "single_edge_bend",
    "single_edge_tension",
    "stress_intensities", "interface_intensity", "refine", "pardiso", "draw_K",
    # growth
    "Cycle", "History", "Step", "collect", "elber", "equivalent_K", "grow", "max_hoop_stress",
    "mean_reference", "paris", "resume", "walker", "weighted_angle", "cycles_between", "load",
    "draw_fronts", "Join", "Response", "respond", "check",
    "K_gradient", "K_over_size", "load_over_cycles", "load_over_size",
    # laws
    "el_haddad", "forman", "hartman_schijve", "klesnil_lukas", "law", "linear_closure", "nasgro",
    "nasgro_K_c", "nasgro3_threshold", "nasgro4_threshold", "newman_closure", "piecewise",
    "Metal", "material", "materials", "plot_rates", "presets", "rate_table",
    "schijve_closure", "stepped_threshold",
    "time_rate", "with_time",
    # verification, reports, files of scenes
    "verify", "validate", "report", "read_case", "run", "sweep", "info", "demo", "convert_mesh",
    "write_case",
    # what users derive from
    "Closure", "GrowthLaw", "Load", "LoadProgram", "Material", "Threshold",
    # campaigns
    "campaign", "grid",
    # lives
    "Scatter", "growth_curve", "inspection", "life", "logistic_pod", "lognormal", "normal",
    "assessment_line", "compliance", "crack_opening", "energy_release_rate", "geometry_factors",
    "opening_load", "write_factors",
    "residual_strength", "plot_strength", "plastic_zone", "retarded", "wheeler", "willenborg",
    # spectra
    "Spectrum", "rainflow", "read_spectrum", "twist", "plot_spectrum",
    "save",
    # errors
    "ConvergenceError", "GeometryError", "MeshError", "ProblemError", "XcrackError",
    "XcrackWarning",
]  # fmt: skip


def test_names_are_the_list() -> None:
    assert sorted(xcrack.__all__) == sorted(NAMES)


def test_dir_shows_the_names() -> None:
    shown = {name for name in dir(xcrack) if not name.startswith("_")}
    assert shown == set(xcrack.__all__)


@pytest.mark.parametrize("name", NAMES)
def test_name_is_there(name: str) -> None:
    assert getattr(xcrack, name).__name__ == name


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = xcrack.no_such_name


def test_version_is_that_of_the_citation() -> None:
    citation = Path(__file__).resolve().parents[2] / "CITATION.cff"
    assert f"\nversion: {xcrack.__version__}\n" in citation.read_text()

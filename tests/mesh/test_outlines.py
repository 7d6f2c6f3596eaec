"""Bodies of any outline, parts of their boundaries, and the meshes of both."""

import numpy as np
import pytest

import xcrack as xc

ROUND_OFF = 1e-12
HALF_DISC = [(-50.0, 0.0), (50.0, 0.0), ((0.0, 50.0), (-50.0, 0.0))]


def length(mesh: xc.Mesh, name: str) -> float:
    x = mesh.points[mesh.facet_sets[name]]
    return float(np.linalg.norm(x[:, 1] - x[:, 0], axis=1).sum())


@pytest.mark.gmsh
def test_half_a_disc_has_its_area_and_refines_onto_its_arc():
    mesh = xc.plate(outline=HALF_DISC, size=6.0, sets={"crown": ((-4, 40), (4, None)), "base": [0]})
    assert set(mesh.facet_sets) == {"arc_1", "crown", "base", "boundary"}
    assert length(mesh, "base") == pytest.approx(100.0, rel=ROUND_OFF)
    assert (mesh.points[mesh.facet_sets["base"]][..., 1] == 0).all()
    # The box ends in points of the mesh: the chord over 8 of the width is all of it.
    x = mesh.points[mesh.facet_sets["crown"]][..., 0]
    assert (x.min(), x.max()) == pytest.approx((-4.0, 4.0), rel=1e-6)
    area = np.pi * 50**2 / 2
    lacks = [1 - m.volume.sum() / area for m in (mesh, xc.refine(mesh))]
    assert 0 < lacks[1] < 0.26 * lacks[0]  # chords: a quarter at half of the size
    on_arc = xc.refine(mesh).points[np.unique(xc.refine(mesh).facet_sets["arc_1"])]
    np.testing.assert_allclose(np.linalg.norm(on_arc, axis=1), 50.0, rtol=ROUND_OFF)


@pytest.mark.gmsh
def test_fillets_notches_and_holes():
    """A bracket: area by hand, clockwise or not."""
    outline = [(0, 0), (60, 0), (60, 20), (40, 20), ((36.464466094067262, 21.464466094067262),
               (35, 25)), (35, 60), (0, 60), (0, 35), ((5, 30), (0, 25))]  # fmt: skip
    area = 60 * 20 + 35 * 40 + (1 - np.pi / 4) * 25 - np.pi * 25 / 2 - np.pi * 16
    for turned in (outline, [*[(0, 25), ((5, 30), (0, 35)), (0, 60), (35, 60), (35, 25)],
                   ((36.464466094067262, 21.464466094067262), (40, 20)), (60, 20), (60, 0),
                   (0, 0)]):  # fmt: skip
        mesh = xc.plate(outline=turned, size=3.0, holes=[((50.0, 10.0), 4.0)])
        assert mesh.volume.sum() == pytest.approx(area, rel=3e-3)  # chords of arcs
        assert {"hole_0", "boundary"} < set(mesh.facet_sets)
        assert (mesh.volume > 0).all()


@pytest.mark.gmsh
def test_parts_of_sides_end_where_they_were_asked_to():
    mesh = xc.plate(
        20.0, 10.0, holes=[((5.0, 5.0), 2.0)], size=1.3,
        sets={
            "seat": ((0, 0), (3, 0)),
            "flank": ((None, None), (0, 4.2)),
            "upper rim": lambda x: (np.hypot(*(x - (5, 5)).T) < 2.1) & (x[:, 1] > 5),
        },
    )  # fmt: skip
    assert length(mesh, "seat") == pytest.approx(3.0, rel=ROUND_OFF)
    # Of the bottom the box has the point (0, 0) alone.
    assert length(mesh, "flank") == pytest.approx(4.2, rel=ROUND_OFF)
    assert length(mesh, "upper rim") == pytest.approx(length(mesh, "hole_0") / 2, rel=ROUND_OFF)
    assert length(mesh, "left") == pytest.approx(10.0, rel=ROUND_OFF)
    supported = xc.Problem(
        mesh, xc.Isotropic(1.0, 0.3, "stress"), supports=[xc.fix("seat"), xc.fix("flank", 0)],
        loads=[xc.traction("top", (0.0, -1.0))],
    )  # fmt: skip
    pushed = xc.solve(supported).report.resultants
    assert sum(row.force[1] for row in pushed) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.gmsh
def test_a_flat_box_on_a_side_holds_all_of_its_points():
    """Corners of a side that are no binary fractions are off the box by round-off."""
    x, y = 0.1 + 0.2, 0.7 * 3
    ends = [(-x, 0.0), (x, 0.0), (x, y), (-x, y)]
    sets = {"upper": ((x, y / 3), (x, y)), "part": ((-x, y), (x / 3, y))}
    mesh = xc.plate(outline=ends, size=0.17, sets=sets)
    assert length(mesh, "upper") == pytest.approx(2 * y / 3, rel=ROUND_OFF)
    assert length(mesh, "part") == pytest.approx(4 * x / 3, rel=ROUND_OFF)
    slanted = xc.plate(outline=[(0, 0), (1, 0.1), (0.9, 1.1), (-0.1, 1)], size=0.1)
    named = xc.part(slanted, "boundary", ((0.9, 0.1), (1.0, 1.1)), "flank")
    assert length(named, "flank") == pytest.approx(np.hypot(0.1, 1), rel=ROUND_OFF)


def test_a_part_of_a_set_of_any_mesh():
    """By a box and by a function, in 2D and 3D; refinement keeps it."""
    mesh = xc.box((0, 0, 0), (2, 1, 1), (8, 4, 4))
    named = xc.part(mesh, "top", ((None, None, None), (0.5, 0.5, None)), "seat")
    x = named.points[named.facet_sets["seat"]]
    assert (x[..., 2] == 1).all()
    assert x[..., :2].max() == 0.5
    assert len(named.facet_sets["seat"]) == 8
    same = xc.part(mesh, "boundary", lambda x: (x[:, 2] > 0.999) & (x[:, :2] < 0.5).all(axis=1))
    assert np.array_equal(same.facet_sets["part of boundary"], named.facet_sets["seat"])
    finer = xc.refine(named)
    assert len(finer.facet_sets["seat"]) == 32
    with pytest.warns(xc.XcrackWarning, match=r"'seat' has facets of 0\.3125 in all, where 0\.302"):
        xc.part(mesh, "top", ((None, None, None), (0.6, 0.5, None)), "seat")


WRONG = {
    "crosses itself near": {"outline": [(0, 0), (1, 1), (1, 0), (0, 1)]},
    "of an arc lie on one line": {"outline": [(0, 0), ((1, 0), (2, 0)), (1, 1)]},
    "encloses nothing": {"outline": [(0, 0), (4, 4)]},
    "comes twice, one after the other": {"outline": [(0, 0), (0, 0), (1, 1)]},
    "outline = .* holds str entries": {"outline": "square"},
    "not both": {"outline": [(0, 0), (1, 0), (0, 1)], "width": 3.0},
    "give width and height of a rectangle, or an outline": {},
    "reaches .* beyond the plate": {"outline": HALF_DISC, "holes": [((0, 45), 6.0)]},
    "has no facets: the middles": {"width": 4.0, "height": 4.0, "sets": {"a": ((9, 9), (9, 9))}},
    "has 'left' by itself": {"width": 4.0, "height": 4.0, "sets": {"left": [0]}},
    "numbers 0 to 3": {"width": 4.0, "height": 4.0, "sets": {"a": [7]}},
    "is inside out": {"width": 4.0, "height": 4.0, "sets": {"a": ((3, 0), (0, 0))}},
}


@pytest.mark.gmsh
@pytest.mark.parametrize("says", WRONG)
def test_wrong_outlines_and_parts_say_why(says):
    with pytest.raises(xc.XcrackError, match=says):
        xc.plate(**{"size": 1.0, **WRONG[says]})

"""What an interactive view of a body in space shows: layers of triangles and lines, packed."""

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Floats
from xcrack.mesh.mesh import Mesh
from xcrack.output.curved_sides import CurvedSides
from xcrack.runs.history import History
from xcrack.view.scene_3d import crack_scene, space_scene
from xcrack.view.section_3d import boundary_edges

MOST = 250_000  # triangles that are packed; seven bytes a corner
_GREY, _EDGE = (143, 163, 184), (64, 64, 64)
_CRACK, _FRONT, _JUNCTION = (214, 96, 77), (178, 24, 43), (123, 50, 148)


def solution_layers(solution: Solution) -> list[dict[str, Any]]:
    """Surface of the body coloured by its equivalent stress, cracks, fronts and edges."""
    body = space_scene(solution, "von_mises", 0.0, None, None, None)
    layers = [
        _layer("body: equivalent stress", "triangles", body.triangles,
               _coloured_layer(body.values, body.limits), 0.35),
        _layer("edges", "lines", body.outline, _EDGE, 1.0),
    ]  # fmt: skip
    if solution.lips:
        cracks = list(range(len(solution.lips)))
        lips = crack_scene(solution, "opening", cracks, 0.0, None, None, None)
        layers += [
            _layer("crack: opening", "triangles", lips.triangles,
                   _coloured_layer(lips.values, lips.limits), 1.0),
            _layer("crack: faces that touch", "triangles", lips.closed_faces, (110, 110, 110), 1.0),
            _layer("fronts", "lines", lips.fronts, _FRONT, 1.0),
            _layer("junctions", "lines", lips.junctions, _JUNCTION, 1.0),
        ]  # fmt: skip
    return [layer for layer in layers if layer["n"]]


def history_layers(history: History) -> list[dict[str, Any]]:
    """The body as far as it is known, and the cracks of each step."""
    layers = [] if history.mesh is None else _body(history.mesh)
    for step in history.steps:
        surface = [crack.points[crack.faces] for crack in step.cracks]
        fronts = [
            np.stack([crack.points[front[:-1]], crack.points[front[1:]]], axis=1)
            for crack in step.cracks
            for front in crack.fronts or ()
            if len(front) > 1
        ]
        for name, kind, parts, colour, shape in (
            ("cracks", "triangles", surface, _CRACK, (0, 3, 3)),
            ("fronts", "lines", fronts, _FRONT, (0, 2, 3)),
        ):
            corners = np.concatenate([np.zeros(shape), *parts])
            layers.append({**_layer(name, kind, corners, colour, 1.0), "step": step.index})
    return [layer for layer in layers if layer["n"]]


def packed_layers(layers: Sequence[dict[str, Any]]) -> dict[str, Any] | None:
    """Layers in one box, as text for a page; None where there is nothing, or too much."""
    triangles = sum(layer["n"] for layer in layers if layer["kind"] == "triangles")
    if not layers or triangles > MOST:
        return None
    corners = np.concatenate([layer["corners"].reshape(-1, 3) for layer in layers])
    low = corners.min(axis=0)
    extent = float(np.ptp(corners, axis=0).max()) or 1.0
    content = []
    for layer in layers:
        share = (layer["corners"].reshape(-1, 3) - low) / extent
        places = np.round(share * 65535).astype("<u2")
        colours = np.asarray(layer["colours"], dtype=np.uint8)
        if colours.ndim == 1:
            colours = np.broadcast_to(colours, (len(places), 3))
        content.append({
            **{key: layer[key] for key in ("name", "kind", "opacity")},
            "step": layer.get("step", -1),
            "places": _text(places), "colours": _text(np.ascontiguousarray(colours)),
        })  # fmt: skip
    middle = np.ptp(corners, axis=0) / extent / 2
    return {"layers": content, "middle": middle.tolist(), "extent": extent}


def _layer(name: str, kind: str, corners: Floats, colours: Any, opacity: float) -> dict[str, Any]:
    return {"name": name, "kind": kind, "corners": corners, "colours": colours,
            "opacity": opacity, "n": len(corners)}  # fmt: skip


def _body(mesh: Mesh) -> list[dict[str, Any]]:
    curved = CurvedSides.of(mesh)
    pairs, facet, is_sharp = boundary_edges(mesh, curved)
    skin, edges = mesh.points[mesh.boundary], mesh.points[pairs[is_sharp]]
    if curved is not None:
        skin = curved.bent(skin, np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0])
        edges = curved.bent(edges, facet[is_sharp])
    return [
        _layer("body", "triangles", skin, _GREY, 0.25),
        _layer("edges", "lines", edges, _EDGE, 1.0),
    ]


def _coloured_layer(values: Floats, limits: tuple[float, float]) -> Any:
    from matplotlib import colormaps

    low, high = limits
    share = np.clip((values.ravel() - low) / ((high - low) or 1.0), 0, 1)
    return np.asarray(255 * colormaps["viridis"](share)[:, :3], dtype=np.uint8)


def _text(array: Any) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()


__all__ = ["MOST", "history_layers", "packed_layers", "solution_layers"]

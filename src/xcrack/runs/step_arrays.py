"""Steps and meshes as named arrays, and back: what a run folder holds, for numpy alone.

Every array has a plain type (numbers, flags, text). Their names are those of the fields of `Step`
and of the values in it; docs/run_folder.md lists them all.
"""

import io
from collections.abc import Sequence
from dataclasses import MISSING, fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from xcrack.base.arrays import Floats, Ints, lock
from xcrack.base.errors import ProblemError
from xcrack.crack.crack import Crack
from xcrack.fatigue.retardation import OverloadZones
from xcrack.growth.solves import SolveHistory
from xcrack.growth.stations import GrowthStations, Identities, PerCrack, split
from xcrack.growth.step import Arrival, Join, Plan, RunState, Step, StepControl, StepError
from xcrack.growth.validity import Validity
from xcrack.linalg.engine import SlipField, SolverState
from xcrack.mesh.curved_facets import CurvedFacets
from xcrack.mesh.mesh import Mesh, sound_mesh
from xcrack.mesh.polygon import Arc
from xcrack.sif.sif import SIF, KErrors, SurfaceEnd, at_stations

Arrays = dict[str, NDArray[Any]]
Value = TypeVar("Value")

_OF_STATIONS = ("angle", "dK_eq", "R", "R_range", "rate", "law_rate", "da")
_OF_PLACES = ("front", "s", "x", "frame")  # of a SIF, the same in all states
_OF_STATES = ("K", "T", "spread", "at_surface", "closed", "domain_cells")
_SIMPLE = (bool, int, float, str)

# Values whose fields are arrays, numbers and texts: an array a field.


def pack(prefix: str, value: Any, leave_out: Sequence[str] = ()) -> Arrays:
    """Fields of a dataclass as arrays ``<prefix>_<field>``; None has none."""
    result: Arrays = {}
    if value is None:
        return result
    for field in fields(value):
        item, name = getattr(value, field.name), f"{prefix}_{field.name}"
        if field.name in leave_out or item is None:
            continue
        if is_dataclass(item):
            result |= pack(name, item)
        else:
            result[name] = _array(item)
    return result


def unpack(kind: type[Value], prefix: str, arrays: Arrays, **other_fields: Any) -> Value | None:
    """What `pack` made arrays of; None where it had none. `other_fields` were left out there."""
    if not any(name.startswith(f"{prefix}_") for name in arrays):
        return None
    hints, values = get_type_hints(kind), dict(other_fields)
    for field in fields(kind):  # type: ignore[arg-type]
        name, hint = f"{prefix}_{field.name}", _without_none(hints[field.name])
        if field.name in other_fields:
            continue
        if is_dataclass(hint):
            values[field.name] = unpack(hint, name, arrays)  # type: ignore[arg-type]
        elif name in arrays:
            values[field.name] = _value(arrays[name], hint)
        elif field.default is MISSING and field.default_factory is MISSING:
            values[field.name] = None
    return kind(**values)


def pack_rows(prefix: str, rows: Sequence[Any]) -> Arrays:
    """Fields of several dataclasses of one kind as columns."""
    if not rows:
        return {}
    names = [field.name for field in fields(rows[0])]
    return {f"{prefix}_{name}": _array([getattr(row, name) for row in rows]) for name in names}


def unpack_rows(kind: type[Value], prefix: str, arrays: Arrays) -> list[Value]:
    """What `pack_rows` made columns of."""
    hints = get_type_hints(kind)
    columns = {
        field.name: arrays[f"{prefix}_{field.name}"]
        for field in fields(kind)  # type: ignore[arg-type]
        if f"{prefix}_{field.name}" in arrays
    }
    count = len(next(iter(columns.values()), ()))
    return [
        kind(**{name: _value(column[k], hints[name]) for name, column in columns.items()})
        for k in range(count)
    ]


def _array(item: Any) -> NDArray[Any]:
    array = np.asarray(item)
    if array.size == 0 and array.dtype.kind == "f" and isinstance(item, tuple | list):
        array = array.astype(np.float64)
    if array.dtype.hasobject:
        raise ProblemError(f"an array of {array.dtype} cannot be stored; use numbers.")
    return array


def _value(array: NDArray[Any], hint: Any) -> Any:
    """An array as what a field holds."""
    hint = _without_none(hint)
    if hint in _SIMPLE:
        return hint(np.asarray(array)[()])
    if get_origin(hint) is tuple:
        kind = get_args(hint)[0]
        return tuple(kind(item) for item in np.asarray(array).tolist())
    return lock(np.array(array))


def _without_none(hint: Any) -> Any:
    parts = [part for part in get_args(hint) if part is not NoneType]
    return parts[0] if get_origin(hint) in (UnionType, Union) and len(parts) == 1 else hint


# Cracks: the points and faces of all, one after the other.


def pack_cracks(prefix: str, cracks: Sequence[Crack]) -> Arrays:
    """Points, faces and ends of cracks, with how many of them each crack has."""
    ends = [[np.array([tip]) for tip in crack.tips or ()] if crack.fronts is None
            else list(crack.fronts) for crack in cracks]  # fmt: skip
    d = cracks[0].dim if cracks else 2
    arms = [(c, on, side) for c, crack in enumerate(cracks) for on, side in crack.ends_on]
    return {
        **({f"{prefix}_arms": np.array(arms, dtype=np.int64)} if arms else {}),
        f"{prefix}_points": np.concatenate([np.zeros((0, d)), *(c.points for c in cracks)]),
        f"{prefix}_point_count": _counts([c.points for c in cracks]),
        f"{prefix}_faces": _whole_numbers(np.zeros((0, d)), *(c.faces for c in cracks)),
        f"{prefix}_face_count": _counts([c.faces for c in cracks]),
        f"{prefix}_ends": _whole_numbers(
            np.zeros(0), *(end for ends_of_crack in ends for end in ends_of_crack)
        ),
        f"{prefix}_end_length": _counts([end for ends_of_crack in ends for end in ends_of_crack]),
        f"{prefix}_end_count": np.array(
            [
                len(ends_of_crack) if crack.placed else -1
                for ends_of_crack, crack in zip(ends, cracks, strict=True)
            ],
            dtype=np.int64,
        ),
    }


def unpack_cracks(prefix: str, arrays: Arrays) -> tuple[Crack, ...]:
    """What `pack_cracks` made arrays of."""
    points, faces, ends = (arrays[f"{prefix}_{name}"] for name in ("points", "faces", "ends"))
    counts = [arrays[f"{prefix}_{name}"].tolist() for name in ("point_count", "face_count")]
    cut_points, cut_faces = (np.cumsum([0, *count]) for count in counts)
    all_ends = np.split(ends, np.cumsum(arrays[f"{prefix}_end_length"])[:-1]) if len(ends) else []
    arms = arrays.get(f"{prefix}_arms", np.zeros((0, 3), dtype=np.int64))
    result, first = [], 0
    for c, count in enumerate(arrays[f"{prefix}_end_count"].tolist()):
        rows = all_ends[first : first + max(count, 0)]
        first += max(count, 0)
        part = slice(cut_points[c], cut_points[c + 1])
        sides = faces[cut_faces[c] : cut_faces[c + 1]]
        tips = fronts = None
        if count >= 0 and points.shape[1] == 2:
            tips = tuple(int(end[0]) for end in rows)
        elif count >= 0:
            fronts = tuple(rows)
        ends_on = tuple((on, side) for crack, on, side in arms.tolist() if crack == c)
        result.append(Crack(points[part], sides, tips, fronts, ends_on))
    return tuple(result)


def _counts(parts: Sequence[Any]) -> Ints:
    return np.array([len(part) for part in parts], dtype=np.int64)


def _whole_numbers(*parts: NDArray[Any]) -> Ints:
    return np.concatenate(parts).astype(np.int64)


# K of all states and cracks.


def _pack_sif(states: Sequence[Sequence[SIF]]) -> Arrays:
    first = states[0]
    for state in states[1:]:
        for a, b in zip(first, state, strict=True):
            if not all(np.array_equal(getattr(a, n), getattr(b, n)) for n in _OF_PLACES):
                raise ProblemError(
                    "K of the load states of a step belongs to different places, and cannot be "
                    "stored: a response has the stations of its problem in each state."
                )
    count = _counts([sif.x for sif in first])
    result: Arrays = {"crack": np.repeat(np.arange(len(first)), count)}
    result |= {n: np.concatenate([getattr(sif, n) for sif in first]) for n in _OF_PLACES}
    result |= {name: at_stations(states, name) for name in _OF_STATES}
    sifs = [[sif for sif in state] for state in states]
    if any(sif.widened is not None for state in sifs for sif in state):
        result["has_widened"] = np.array([[s.widened is not None for s in row] for row in sifs])
        result["widened"] = _or_nan(sifs, lambda sif: sif.widened)
    if any(sif.E_prime is not None for state in sifs for sif in state):
        result["has_moduli"] = np.array([[s.E_prime is not None for s in row] for row in sifs])
        for name in ("E_prime", "nu"):
            rows = [[_or_nan_row(sif, getattr(sif, name)) for sif in row] for row in sifs]
            result[name] = np.stack([np.concatenate(row) for row in rows])
    if any(sif.errors is not None for state in sifs for sif in state):
        result["has_bar"] = np.array([[s.errors is not None for s in row] for row in sifs])
        result["has_contact_bar"] = np.array(
            [[s.errors is not None and s.errors.contact is not None for s in r] for r in sifs]
        )
        result["eta"] = _or_nan(sifs, lambda sif: sif.errors and sif.errors.eta)
        result["bar"] = _or_nan(sifs, lambda sif: sif.errors and sif.errors.bar)
        result["contact_bar"] = _or_nan(sifs, lambda sif: sif.errors and sif.errors.contact)
        reasons = [
            [r for sif in row for r in (sif.errors.reasons if sif.errors else [""] * len(sif.x))]
            for row in sifs
        ]
        result["bar_reason"] = np.array(reasons, dtype=str).reshape(len(states), -1)
    corners = [
        (k, c, end) for k, row in enumerate(sifs) for c, sif in enumerate(row) for end in sif.ends
    ]
    if corners:
        result["corner_state"] = np.array([k for k, _, _ in corners])
        result["corner_crack"] = np.array([c for _, c, _ in corners])
        result |= pack_rows("corner", [end for _, _, end in corners])
    return result


def _or_nan_row(sif: SIF, value: Floats | None) -> Floats:
    return np.full(len(sif.x), np.nan) if value is None else value


def _or_nan(sifs: Sequence[Sequence[SIF]], part: Any) -> Floats:
    """Values of all states and stations `(s, n, m)`, nan where a SIF has none."""
    rows = []
    for row in sifs:
        values = [part(sif) for sif in row]
        columns = [
            np.full_like(sif.K, np.nan) if value is None else value
            for sif, value in zip(row, values, strict=True)
        ]
        rows.append(np.concatenate(columns))
    return np.stack(rows)


def _unpack_sif(arrays: Arrays, n_cracks: int) -> tuple[tuple[SIF, ...], ...]:
    if "K" not in arrays:
        return ()
    crack = arrays["crack"]
    corners = unpack_rows(SurfaceEnd, "corner", arrays) if "corner_state" in arrays else []
    result = []
    for k in range(len(arrays["K"])):
        row = []
        for c in range(n_cracks):
            is_of_crack = crack == c
            values = {n: lock(arrays[n][is_of_crack]) for n in _OF_PLACES}
            values |= {n: lock(arrays[n][k][is_of_crack]) for n in _OF_STATES}
            if "widened" in arrays and arrays["has_widened"][k, c]:
                values["widened"] = lock(arrays["widened"][k][is_of_crack])
            if "E_prime" in arrays and arrays["has_moduli"][k, c]:
                values |= {n: lock(arrays[n][k][is_of_crack]) for n in ("E_prime", "nu")}
            errors = None
            if "bar" in arrays and arrays["has_bar"][k, c]:
                eta, bar, contact = (
                    lock(arrays[n][k][is_of_crack]) for n in ("eta", "bar", "contact_bar")
                )
                reasons = tuple(arrays["bar_reason"][k][is_of_crack].tolist())
                has_part = arrays["has_contact_bar"][k, c]
                errors = KErrors(eta, bar, reasons, contact if has_part else None)
            ends = tuple(
                end
                for j, end in enumerate(corners)
                if arrays["corner_state"][j] == k and arrays["corner_crack"][j] == c
            )
            row.append(SIF(**values, errors=errors, ends=ends))  # type: ignore[arg-type]
        result.append(tuple(row))
    return tuple(result)


# What the next solve starts from.


def _pack_reuse(state: SolverState) -> Arrays:
    result: Arrays = {"reuse_levels": np.array(state.levels, dtype=np.float64)}
    result["reuse_count"] = np.array([len(state.centre), len(state.slip)])
    for c, (centre, closed_sets) in enumerate(zip(state.centre, state.active, strict=True)):
        if centre is not None:
            result[f"reuse_centre_{c}"] = centre
        if closed_sets is not None:
            result[f"reuse_closed_{c}"] = closed_sets
    for c, slip in enumerate(state.slip):
        result |= pack(f"reuse_slip_{c}", slip)
    return result


def _unpack_reuse(arrays: Arrays) -> SolverState:
    n_cracks, n_slip = arrays["reuse_count"].tolist()
    centre, closed_sets = (
        tuple(arrays.get(f"reuse_{name}_{c}") for c in range(n_cracks))
        for name in ("centre", "closed")
    )
    slip = tuple(unpack(SlipField, f"reuse_slip_{c}", arrays) for c in range(n_slip))
    return SolverState(
        centre, closed_sets, levels=tuple(arrays["reuse_levels"].tolist()), slip=slip
    )


# A step.


def arrays_of(step: Step) -> Arrays:
    """All of a step but its solutions, as arrays by name.

    Raises
    ------
    ProblemError
        K of its states belongs to different places.
    """
    result: Arrays = {
        "index": np.array(step.index),
        "cycles": np.array(float(step.cycles)),
        "states": np.array(step.states, dtype=str),
        "levels": np.array(step.levels, dtype=np.float64),
        "sizes": np.array(step.sizes, dtype=np.float64),
        **pack_cracks("crack", step.cracks),
    }
    if step.load_factor != 1:
        result["load_factor"] = np.array(float(step.load_factor))
    if step.corrected is not step.cracks:
        result |= pack_cracks("corrected", step.corrected)
    if step.sif:
        result |= _pack_sif(step.sif)
    for name in _OF_STATIONS:
        parts: PerCrack = getattr(step, name)
        if parts:
            result[name] = np.concatenate(parts)
    result |= pack("station", step.stations)
    result |= pack("solves", step.solves)
    result |= pack("zones", step.zones)
    result |= pack("earlier_zones", step.earlier_zones)
    result |= pack("control", step.control)
    result |= pack("error", step.error, ("place", "newest_place"))
    if step.error is not None:
        result["error_place"] = np.concatenate([np.zeros(0), *step.error.place])
        if step.error.newest_place:
            result["error_newest_place"] = np.concatenate(step.error.newest_place)
    if step.plan is not None:
        result |= pack("plan", step.plan, ("cracks", "apart", "joins"))
        result |= pack_rows("plan_join", step.plan.joins)
        if step.plan.cracks is not step.corrected:
            result |= pack_cracks("plan", step.plan.cracks)
        if step.plan.apart:
            result |= pack_cracks("apart", step.plan.apart)
    result |= pack_rows("arrival", step.arrivals) | pack_rows("join", step.joins)
    if step.warnings is not None:
        result["warnings"] = np.array(step.warnings, dtype=str)
    if step.identities is not None:
        result["identity_crack"] = np.array(step.identities.cracks, dtype=np.int64)
        result["identity_end"] = _whole_numbers(np.zeros(0), *map(np.array, step.identities.ends))
        result["identity_end_count"] = _counts(step.identities.ends)
        result["identity_name"] = np.array(step.identities.names, dtype=str)
    if step.validity is not None:
        result |= pack("validity", step.validity, ("places",))
        result["validity_number"] = np.array(list(step.validity.places), dtype=str)
        result["validity_place"] = np.array(list(step.validity.places.values()), dtype=str)
    if step.run is not None:
        result |= pack("run", step.run, ("settings", "reuse")) | _pack_reuse(step.run.reuse)
    return result


def step_of(arrays: Arrays, settings: dict[str, str] | None = None) -> Step:
    """The step that arrays were made of, without its solutions.

    Parameters
    ----------
    arrays : mapping of str to array
    settings : mapping of str to str, optional
        Of the run.

    Raises
    ------
    KeyError
        An array is missing.
    """
    cracks = unpack_cracks("crack", arrays)
    corrected_cracks = (
        unpack_cracks("corrected", arrays) if "corrected_points" in arrays else cracks
    )
    sif = _unpack_sif(arrays, len(cracks))
    counts = np.bincount(arrays.get("crack", np.zeros(0, dtype=np.int64)), minlength=len(cracks))

    def per_crack(name: str) -> PerCrack:
        if name not in arrays:
            return ()
        return tuple(lock(part) for part in split(arrays[name], counts.tolist()))

    of_stations: dict[str, Any] = {name: per_crack(name) for name in _OF_STATIONS}
    plan = None
    if "plan_sigma" in arrays:
        plan = unpack(
            Plan,
            "plan",
            arrays,
            cracks=unpack_cracks("plan", arrays) if "plan_points" in arrays else corrected_cracks,
            apart=unpack_cracks("apart", arrays) if "apart_points" in arrays else (),
            joins=tuple(unpack_rows(Join, "plan_join", arrays)),
        )
    error = None
    if "error_place" in arrays:
        places = {name: per_crack(f"error_{name}") for name in ("place", "newest_place")}
        error = unpack(StepError, "error", arrays, **places)
    identities = None
    if "identity_crack" in arrays:
        ends = split(arrays["identity_end"], arrays["identity_end_count"].tolist())
        identities = Identities(
            tuple(arrays["identity_crack"].tolist()),
            tuple(tuple(int(end) for end in ends_of_crack) for ends_of_crack in ends),
            tuple(arrays["identity_name"].tolist()),
        )
    run = None
    if "run_meshes" in arrays:
        run = unpack(RunState, "run", arrays, settings=settings or {}, reuse=_unpack_reuse(arrays))
    validity = None
    if "validity_number" in arrays:
        names, words = (arrays[f"validity_{name}"].tolist() for name in ("number", "place"))
        validity = unpack(Validity, "validity", arrays, places=dict(zip(names, words, strict=True)))
    return Step(
        index=int(arrays["index"]),
        cycles=float(arrays["cycles"]),
        cracks=cracks,
        sif=sif,
        **of_stations,
        levels=tuple(arrays["levels"].tolist()),
        corrected=corrected_cracks,
        error=error,
        warnings=tuple(arrays["warnings"].tolist()) if "warnings" in arrays else None,
        arrivals=tuple(unpack_rows(Arrival, "arrival", arrays)),
        joins=tuple(unpack_rows(Join, "join", arrays)),
        states=tuple(arrays["states"].tolist()),
        sizes=tuple(arrays["sizes"].tolist()),
        load_factor=float(arrays.get("load_factor", 1.0)),
        identities=identities,
        stations=unpack(GrowthStations, "station", arrays),
        solves=unpack(SolveHistory, "solves", arrays),
        zones=unpack(OverloadZones, "zones", arrays),
        earlier_zones=unpack(OverloadZones, "earlier_zones", arrays),
        control=unpack(StepControl, "control", arrays) or StepControl(),
        plan=plan,
        run=run,
        validity=validity,
    )


# A mesh.


_CURVES: dict[str, tuple[type, str]] = {  # by prefix, with a field that each has
    "arc": (Arc, "center"),
    "pieces": (CurvedFacets, "points"),
}


def arrays_of_mesh(mesh: Mesh) -> Arrays:
    """Points, cells, sets and curves of a mesh, but for curves that are functions of the user."""
    result: Arrays = {"points": mesh.points, "cells": mesh.cells}
    for kind, sets in (("facet_set", mesh.facet_sets), ("cell_set", mesh.cell_sets)):
        result |= {f"{kind}_{name}": sets[name] for name in sorted(sets)}
    for name, curve in sorted(mesh.curves.items()):
        for prefix, (curve_kind, _) in _CURVES.items():
            if isinstance(curve, curve_kind):
                result |= pack(f"{prefix}_{name}", curve)
    return result


def mesh_of(arrays: Arrays) -> Mesh:
    """The mesh that arrays were made of."""
    sets = {
        kind: {
            name.removeprefix(kind): members
            for name, members in arrays.items()
            if name.startswith(kind)
        }
        for kind in ("facet_set_", "cell_set_")
    }
    curves: dict[str, Any] = {
        name: unpack(curve_kind, f"{prefix}_{name}", arrays)
        for name in sets["facet_set_"]
        for prefix, (curve_kind, field) in _CURVES.items()
        if f"{prefix}_{name}_{field}" in arrays
    }
    return sound_mesh(
        arrays["points"], arrays["cells"], sets["facet_set_"], sets["cell_set_"], curves
    )


# Files.


_COUNT = "array_count"


def packed_arrays(arrays: Arrays) -> bytes:
    """Content of a file of numpy with some arrays, and how many they are."""
    buffer, count = io.BytesIO(), np.array(len(arrays))
    np.savez(buffer, allow_pickle=False, **{_COUNT: count}, **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


def read_arrays(data: bytes) -> Arrays | None:
    """Arrays of a file of numpy; None where it is damaged, or none of these."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as members:
            arrays = {name: members[name] for name in members.files}
        # Members have checksums, the directory of the file has none: a bit of it may hide some.
        count = arrays.pop(_COUNT, None)
        is_whole = count is None or int(count) == len(arrays)
        # A member whose name has lost its ending is handed over as bytes.
        is_whole &= all(isinstance(array, np.ndarray) for array in arrays.values())
        return arrays if is_whole else None
    except Exception:  # whatever zipfile, zlib and numpy say of bytes that are not theirs
        return None


__all__ = [
    "Arrays",
    "arrays_of",
    "arrays_of_mesh",
    "mesh_of",
    "pack",
    "packed_arrays",
    "read_arrays",
    "step_of",
    "unpack",
]

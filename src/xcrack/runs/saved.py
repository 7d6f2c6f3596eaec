"""Solutions and histories in files, without pickle: what was solved, not matrices.

Functions among loads and supports cannot be stored. A solution that comes back has a name in their
place: pictures, K and reports work; solving again asks for the script.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.analysis import plan
from xcrack.analysis.contact import Contact
from xcrack.analysis.plan import Ingredient, Report
from xcrack.analysis.solution import Solution
from xcrack.base.arguments import arguments_of, kinds_of
from xcrack.base.arrays import Floats, lock
from xcrack.base.errors import ProblemError
from xcrack.base.paths import path_of, system_errors
from xcrack.crack.crack import Crack
from xcrack.fem.system import discretise
from xcrack.linalg.engine import SlipField, SolverState
from xcrack.mesh.curved_facets import CurvedFacets
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.polygon import Arc
from xcrack.model.loads import Condition
from xcrack.model.material import Material, MaterialSets, StoredFunction
from xcrack.model.numerics import Numerics
from xcrack.model.problem import LoadLevel, LoadState, Problem
from xcrack.runs import run_folder, store
from xcrack.runs.history import History
from xcrack.runs.step_arrays import (
    Arrays,
    arrays_of,
    arrays_of_mesh,
    mesh_of,
    packed_arrays,
    read_arrays,
    step_of,
)

_FORMAT = 1
_SUFFIX = ".npz"


@dataclass(frozen=True)
class Unstorable:
    """Stands for a function that a file could not hold.

    Attributes
    ----------
    name : str
    """

    name: str

    def __call__(self, *values: Any) -> Any:
        """Refuse to be called."""
        raise ProblemError(
            f"the function {self.name} was not stored with the solution: make the problem again by "
            "the script that made it."
        )


_CLASSES: dict[str, type] = {
    "LoadResultant": plan.Resultant,
    **{
        kind.__name__: kind
        for kind in (Problem, Mesh, Arc, CurvedFacets, Crack, Numerics, Contact, Report,
                     Ingredient, SolverState, SlipField, Unstorable, LoadLevel, LoadState,
                     StoredFunction)
    },
}  # fmt: skip


def _classes() -> dict[str, type]:
    """What a file may hold: materials, supports and loads of users among them."""
    return _CLASSES | kinds_of(Material) | kinds_of(Condition)


def save(result: Solution | Sequence[Solution] | History, path: str | PathLike[str]) -> Path:
    """Save a solution, the solutions of one solve, or a history to a file.

    Parameters
    ----------
    result : Solution, list of Solution, or History
        Of a history without the solutions of its steps.
    path : path
        ``.npz`` is added to one without suffix. `load` reads it.

    Returns
    -------
    Path

    Raises
    ------
    ProblemError
        Something else than these, or a file that cannot be written.
    """
    file = path_of(path, "save: path", error=ProblemError, is_file=True)
    file = file if file.suffix else file.with_name(file.name + _SUFFIX)
    if isinstance(result, History):
        data = packed_arrays(_arrays_of_history(result))
    else:
        data = store.packed_content({"format": _FORMAT, **_content(result)}, _classes())
    with system_errors("the result cannot be written to", file, error=ProblemError):
        file.parent.mkdir(parents=True, exist_ok=True)
        store.write_whole(file, data)
    return file


def read_saved(path: Path) -> Any:
    """What `save` wrote.

    Raises
    ------
    ProblemError
        The file is not one of these, or of a newer xcrack.
    """
    with system_errors("a stored value cannot be read from", path, error=ProblemError):
        arrays = read_arrays(path.read_bytes())
    if arrays is not None and "history" in arrays:
        return _history_of(arrays, path)
    content = store.load(path, _classes())
    if not isinstance(content, dict) or "format" not in content:
        raise ProblemError(f"{path} is not a file that save wrote, or it is damaged.")
    if content["format"] > _FORMAT:
        raise ProblemError(f"{path} was written by a newer xcrack: update xcrack.")
    solutions = _solutions(content)
    return solutions if content["several"] else solutions[0]


def _arrays_of_history(history: History) -> Arrays:
    """Arrays of all steps, as in the folder of a run, each behind the number of its step."""
    result: Arrays = {
        "history": np.array(run_folder.FORMAT),
        "n_steps": np.array(len(history.steps)),
        "ended": np.array(history.ended),
        "settings": np.array(json.dumps(dict(history.settings))),
    }
    for k, step in enumerate(history.steps):
        result |= {f"{k:05d}_{name}": values for name, values in arrays_of(step).items()}
    if history.mesh is not None:
        mesh = arrays_of_mesh(history.mesh)
        result |= {f"mesh_{name}": values for name, values in mesh.items()}
    return result


def _history_of(arrays: Arrays, path: Path) -> History:
    """The history of a file.

    Raises
    ------
    ProblemError
        It is damaged, or of a newer xcrack.
    """
    if int(arrays["history"]) > run_folder.FORMAT:
        raise ProblemError(f"{path} was written by a newer xcrack: update xcrack.")

    def part(prefix: str) -> Arrays:
        names = (name for name in arrays if name.startswith(prefix))
        return {name.removeprefix(prefix): arrays[name] for name in names}

    try:
        settings = json.loads(str(arrays["settings"]))
        arrays_of_steps = [part(f"{k:05d}_") for k in range(int(arrays["n_steps"]))]
        steps = tuple(step_of(arrays_of_step, settings) for arrays_of_step in arrays_of_steps)
        mesh = mesh_of(part("mesh_")) if "mesh_points" in arrays else None
        return History(steps, str(arrays["ended"]), None, mesh)
    except (KeyError, ValueError, IndexError) as error:
        raise ProblemError(f"{path} is not a file that save wrote, or it is damaged.") from error


def stored_condition(condition: Any) -> Any:
    """A support or load whose functions are replaced by their names."""
    changes = {}
    for name in arguments_of(type(condition)):
        value = getattr(condition, name)
        if callable(value) and not isinstance(value, Unstorable):
            changes[name] = Unstorable(getattr(value, "__name__", type(value).__name__))
    return replace(condition, **changes) if changes else condition


def _stored_state(load_state: LoadState) -> LoadState:
    return replace(load_state, loads=tuple(map(stored_condition, load_state.loads)))


def _content(result: Any) -> dict[str, Any]:
    has_several = not isinstance(result, Solution)
    solutions = list(result) if isinstance(result, list | tuple) else [result]
    if not solutions or not all(isinstance(solution, Solution) for solution in solutions):
        raise ProblemError(
            f"save takes a Solution, a list of them, or a History, not a {type(result).__name__}."
        )
    if any(solution.space is not solutions[0].space for solution in solutions):
        raise ProblemError("save: the solutions are of different solves: save each on its own.")
    first = solutions[0]
    return {
        "several": has_several,
        "problem": _problem_for_file(first.problem),
        "reuse": first.reuse.without_matrices(),
        "states": [_state(solution) for solution in solutions],
    }


def _problem_for_file(problem: Problem) -> Problem:
    """A problem whose functions are replaced by their names; curves of the user are left out."""
    curves = {k: c for k, c in problem.mesh.curves.items() if isinstance(c, Arc | CurvedFacets)}
    mesh = problem.mesh
    return replace(
        problem,
        material=_stored_material(problem),
        mesh=mesh if len(curves) == len(mesh.curves) else replace(mesh, curves=curves),
        supports=tuple(map(stored_condition, problem.supports)),
        loads=tuple(map(stored_condition, problem.loads)),
    )


def _stored_material(problem: Problem) -> Material:
    """The material, whose graded moduli are replaced by their values at the nodes of the mesh."""
    elasticity, mesh = problem.elasticity, problem.mesh
    if elasticity.node_moduli is None:
        return elasticity.material
    stored_materials = {}
    for k, (name, material) in enumerate(elasticity.named):
        cells = np.arange(len(mesh.cells))
        cells = cells[elasticity.set_number == k] if len(elasticity.set_number) else cells
        values = np.full(mesh.n_points + len(mesh.edges), np.nan)
        values[mesh.corners_and_edges[cells]] = elasticity.node_moduli[cells]
        stored_materials[name] = material.stored(lock(values))
    return stored_materials[""] if "" in stored_materials else MaterialSets(stored_materials)


def _state(solution: Solution) -> dict[str, Any]:
    state = solution.state
    if isinstance(state, list | tuple):
        state = [stored_condition(load) for load in state]
    elif isinstance(state, LoadLevel):
        state = replace(state, steady=tuple(map(stored_condition, state.steady)))
    return {
        "state": state,
        "acting": _stored_state(solution.acting),
        "u": solution.u,
        "contact": solution.contact,
        "energy": solution.energy,
        "summary": solution.summary,
        "dissipated": solution.dissipated,
    }


def _solutions(content: dict[str, Any]) -> list[Solution]:
    """Solutions on a space that is made anew: the same numbering for the same problem."""
    problem: Problem = content["problem"]
    space, lips = discretise(problem)
    reuse: SolverState = content["reuse"]
    solutions = []
    for state in content["states"]:
        u: Floats = lock(np.asarray(state["u"]))
        if u.shape != (space.n_dof,):
            raise ProblemError(
                f"the file holds {len(u)} unknowns, and its problem has {space.n_dof} in this "
                "xcrack: read it with the version that wrote it."
            )
        names = ("state", "acting", "contact", "energy", "dissipated")
        parts = {name: state[name] for name in names}
        parts["make_summary"] = partial(replace, state["summary"])  # a copy of it
        solutions.append(
            Solution(problem=problem, space=space, u=u, lips=lips, reuse=reuse,
                     **parts)
        )  # fmt: skip
    return solutions


__all__ = ["Unstorable", "read_saved", "save"]

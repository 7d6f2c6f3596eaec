"""A basis of modes: the fields of K alone at a tip, as a restriction of the solver's basis.

The four tip functions times the d components of the displacement contain the fields of modes I
and II, and III in 3D. Their span at a point has d columns instead of 4 d: cheaper and better
conditioned, but blind to every field near a tip that is not one of its modes. It is there to be
compared with the functions one by one.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.base.errors import ProblemError
from xcrack.fem.function_space import FunctionSpace, Tip
from xcrack.fem.williams import mode_matrix
from xcrack.model.material import Material
from xcrack.model.numerics import TipBasis


@dataclass(frozen=True)
class modal_basis(TipBasis):  # noqa: N801 - it is used as a function
    """One unknown a mode at each point, two in 2D and three in 3D, instead of one a function."""

    def label(self, dim: int) -> str:
        """What reports call it."""
        return f"modes I to {'II' if dim == 2 else 'III'} only"

    def unknowns(self, dim: int) -> int:
        """Unknowns of a point: one a mode."""
        return dim

    def columns(
        self, space: FunctionSpace, material: Material | None, is_free: Bools
    ) -> tuple[sp.csr_matrix, Bools]:
        """See `mode_columns`."""
        return mode_columns(space, material, is_free)


def mode_columns(
    space: FunctionSpace, material: Material | None, is_free: Bools
) -> tuple[sp.csr_matrix, Bools]:
    """Basis in which each enriched point has one unknown a mode, and which columns are in use.

    Mode m of a point takes the place of unknown m of its first tip function; the places of its
    other tip unknowns stay empty. Where a support decides any tip unknown of a point, none of its
    modes can be chosen freely, and the point goes without. All other columns are those of the
    identity.

    Parameters
    ----------
    space : FunctionSpace
        With four functions a tip.
    material : Material or None
        The angular part of the modes depends on Poisson's ratio.
    is_free : (n_dof,) array of bool
        Unknowns that supports leave.

    Returns
    -------
    columns : sparse matrix (n_dof, n_dof)
    is_free : (n_dof,) array of bool
        Columns that stand for an unknown.
    """
    if material is None:
        raise ProblemError("modal_basis needs the material of the body.")
    d = space.dim
    modes = local_modes(material.at_tip().kolosov, d)
    rows, columns, values = [], [], []
    is_plain = np.ones(space.n_dof, dtype=bool)
    is_used = np.array(is_free)
    for tip in space.tips:
        points = np.nonzero(tip.point_to_function >= 0)[0]
        functions = tip.point_to_function[points][:, None] + np.arange(tip.functions)
        unknowns = functions[:, :, None] * d + np.arange(d)
        is_plain[unknowns] = is_used[unknowns] = False
        is_whole = is_free[unknowns].all(axis=(1, 2))
        points, unknowns = points[is_whole], unknowns[is_whole]
        # (points, modes, functions, components)
        share = np.einsum("mal,pac->pmlc", modes, _frames(space, tip, points))
        column = unknowns[:, 0, :]
        is_used[column] = True
        rows.append(np.broadcast_to(unknowns[:, None], share.shape).ravel())
        columns.append(np.broadcast_to(column[:, :, None, None], share.shape).ravel())
        values.append(share.ravel())
    unchanged_columns = np.nonzero(is_plain)[0]
    rows.append(unchanged_columns)
    columns.append(unchanged_columns)
    values.append(np.ones(len(unchanged_columns)))
    triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    matrix = sp.csr_matrix(triplets, shape=(space.n_dof, space.n_dof))
    matrix.eliminate_zeros()
    return matrix, lock(is_used)


def local_modes(kolosov: float, dim: int) -> Floats:
    """Modes in the frame of a tip `(modes, components, 4)`, up to a factor.

    I and II of Williams (1957) in the components (ahead, normal); in 3D III, 4 F_2 along the
    front.
    """
    modes = np.zeros((dim, dim, 4))
    modes[:2, :2] = mode_matrix(kolosov, 1.0)
    if dim == 3:
        modes[2, 2, 1] = 4 / (2 * np.sqrt(2 * np.pi))
    return modes


def _frames(space: FunctionSpace, tip: Tip, points: Ints) -> Floats:
    """Frames at mesh points: those of the tip, or in 3D of the nearest vertex of the front."""
    if tip.frame.ndim == 2:
        return np.broadcast_to(tip.frame, (len(points), *tip.frame.shape))
    _, nearest = cKDTree(tip.x).query(space.mesh.points[points])
    return np.asarray(tip.frame[nearest])

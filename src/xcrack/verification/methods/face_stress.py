"""Normal stress on the crack faces, as rows: what Nitsche's method needs beside the gaps.

The stress is a mean of both crack faces, weighted by the parts of the cell on either side, so that
a sliver has no say (Hansbo and Hansbo, 2002; Annavarapu, Hautefeuille and Dolbow, 2012).
"""

import numpy as np
import scipy.sparse as sp

from xcrack.base.arrays import Floats
from xcrack.fem.facets import LipPoints
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.quadrature import lip_side
from xcrack.model.material import Material
from xcrack.model.problem import LoadState


def stress_matrix(
    space: FunctionSpace, material: Material, c: int, lips: LipPoints
) -> sp.csr_matrix:
    """Mean normal stress n . sigma . n at the lip points, of the strain alone `(q, n_dof)`.

    Parameters
    ----------
    space : FunctionSpace
    material : Material
    c : int
        Crack.
    lips : LipPoints
    """
    d, share = space.dim, lip_shares(space, c, lips)
    stiffness = material.tensor(d)
    rows, columns, values = [], [], []
    for s, sign in ((0, -1), (1, 1)):
        cell = lips.cell[:, s]
        side = lip_side(space, c, cell, lips.bary[:, s], sign)
        for batch, number, row in space.batches_of_points(cell):
            _, G = space.tabulate(batch, row, lips.bary[number, s], side[number])
            functions = batch.functions[row]
            normal = lips.normal[number]
            across = np.einsum("ijkl,qi,qj->qkl", stiffness, normal, normal)
            stress = np.einsum("qkl,qnl->qnk", across, G)
            stress *= share[number, s, None, None]
            acts = functions >= 0
            point = np.broadcast_to(number[:, None], functions.shape)[acts]
            for i in range(d):
                rows.append(point)
                columns.append(functions[acts] * d + i)
                values.append(stress[acts, i])
    triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    matrix = sp.csr_matrix(triplets, shape=(len(lips), space.n_dof))
    matrix.sum_duplicates()
    return matrix


def lip_shares(space: FunctionSpace, c: int, lips: LipPoints) -> Floats:
    """Shares of the stress on lip - and lip + in their mean `(q, 2)`: of the cells' volumes.

    Parameters
    ----------
    space : FunctionSpace
    c : int
        Crack.
    lips : LipPoints
    """
    cut, mesh = space.cuts[c], space.mesh
    volume = np.zeros((len(mesh.cells), 2))
    place = (cut.sub_side > 0).astype(np.int64)
    np.add.at(volume, (cut.sub_to_cell, place), cut.sub_fraction)
    whole = lips.cell[:, 0] != lips.cell[:, 1]
    part = np.stack([volume[lips.cell[:, 0], 0], volume[lips.cell[:, 1], 1]], axis=1)
    part[whole] = 1.0
    part *= mesh.volume[lips.cell]
    return np.asarray(part / part.sum(axis=1, keepdims=True))


def averaging(space: FunctionSpace, lips: LipPoints) -> sp.csr_matrix:
    """Projection on polynomials of one degree less than u on each lip segment or triangle `(q, q)`.

    The stress of the tip functions goes like 1 / sqrt(r) along the crack faces: its square could
    not be integrated, and at points near a tip a small error in K would be a large pressure.
    """
    n = int(lips.segment.max()) + 1
    # Segments without points divide by something that is not zero.
    size = np.maximum(np.bincount(lips.segment, lips.weight, n), 1e-300)
    first = np.stack([np.bincount(lips.segment, lips.weight * x, n) for x in lips.x.T], axis=1)
    centre = first / size[:, None]
    basis = np.ones((len(lips), 1))
    if space.order == 2:
        local = lips.x - centre[lips.segment]
        extent = np.zeros(n)
        np.maximum.at(extent, lips.segment, np.abs(local).max(axis=1))
        basis = np.concatenate([basis, local / extent[lips.segment, None]], axis=1)
    m = basis.shape[1]
    gram = np.zeros((n, m, m))
    np.add.at(gram, lips.segment, lips.weight[:, None, None] * basis[:, :, None] * basis[:, None])
    # In the plane of a lip its normal adds no function: a pseudo-inverse leaves it out.
    inverse = np.linalg.pinv(gram / size[:, None, None], rcond=1e-9)
    inverse /= size[:, None, None]
    place = np.arange(n + 1)
    middle = sp.bsr_matrix((inverse, place[:-1], place), shape=(n * m, n * m))
    row = np.repeat(np.arange(len(lips)), m)
    column = (lips.segment[:, None] * m + np.arange(m)).ravel()
    B = sp.csr_matrix((basis.ravel(), (row, column)), shape=(len(lips), n * m))
    return sp.csr_matrix(B @ middle @ B.T @ sp.diags(lips.weight))


def tip_distance(space: FunctionSpace, c: int, lips: LipPoints) -> Floats:
    """Mean distance of each point's lip segment to the nearest tip or front `(q,)`, length.

    Parameters
    ----------
    space : FunctionSpace
    c : int
        Crack.
    lips : LipPoints
    """
    nearest = np.full(len(lips), np.inf)
    cell = space.mesh.cells[lips.cell[:, 1]]
    for psi in space.cuts[c].level_set.psi:
        along = np.abs(np.einsum("qb,qb->q", lips.bary[:, 1], psi[cell]))
        nearest = np.fmin(nearest, along)
    total = np.bincount(lips.segment, lips.weight * nearest)
    size = np.bincount(lips.segment, lips.weight)
    return np.asarray((total / np.maximum(size, 1e-300))[lips.segment])


def steady_stress(material: Material, lips: LipPoints, c: int, acting: LoadState) -> Floats:
    """Normal stress that loads add to that of the strain `(q,)`: initial stress, given pressure.

    Parameters
    ----------
    material : Material
    lips : LipPoints
    c : int
        Crack.
    acting : LoadState
    """
    total = np.zeros(len(lips))
    for load, factor in acting:
        if "initial_stress" in load.acts:
            sigma = factor * load.initial_stress(lips.x, material)
            total += np.einsum("qi,qij,qj->q", lips.normal, sigma, lips.normal)
        if "face_pressure" in load.acts:
            p = load.face_pressure(lips.x, c)
            total += 0.0 if p is None else factor * p
    return total

"""Meshes from one file to another."""

from xcrack.base.arguments import FileName, check_arguments
from xcrack.base.errors import MeshError
from xcrack.mesh.files import read_mesh, write_mesh
from xcrack.mesh.mesh import Mesh


@check_arguments(MeshError)
def convert_mesh(source: FileName, target: FileName) -> Mesh:
    """Read a mesh from a file and write it to another one, of another kind if need be.

    Parameters
    ----------
    source, target : path
        Files that `read_mesh` reads and `write_mesh` writes; their endings say the kind.

    Returns
    -------
    Mesh

    Raises
    ------
    MeshError
        A file that cannot be read or written, or a mesh that is not sound.
    """
    mesh = read_mesh(source)
    write_mesh(target, mesh)
    return mesh


__all__ = ["convert_mesh"]

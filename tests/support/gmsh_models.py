"""Bodies that tests draw with gmsh itself."""

from contextlib import contextmanager


@contextmanager
def gmsh_model(**options):
    """gmsh with an empty model; options have ``__`` for the dot. It is closed at the end."""
    import gmsh

    gmsh.initialize([], readConfigFiles=False, run=False, interruptible=False)
    try:
        for name, value in {"General__Terminal": 0, "General__NumThreads": 1, **options}.items():
            gmsh.option.setNumber(name.replace("__", "."), value)
        gmsh.model.add("body")
        yield gmsh
    finally:
        gmsh.finalize()

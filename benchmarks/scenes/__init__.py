"""The scenes of the charts and the exact solutions that they are compared with."""

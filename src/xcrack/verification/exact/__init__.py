"""Exact fields and reference tables that tests, benchmarks and readers compare xcrack with.

Nothing of the solver is used here. Units are any consistent set; the material is isotropic with
Young's modulus E and Poisson's ratio nu. K is the limit of sqrt(2 pi r) times the stress ahead of
a tip. The jump is the displacement of the upper face minus that of the lower one; closed faces
press against each other with p = -s_yy >= 0.

Fields in 2D are functions (x, y, ...) -> (u, s) of broadcastable coordinates: displacements
`(..., 2)` and stresses `(..., 3)`, in the order xx, yy, xy. Points with y = 0 on a crack lie on the
face that `side` names: +1 the upper, -1 the lower. Fields in 3D take points `(..., 3)`.
"""

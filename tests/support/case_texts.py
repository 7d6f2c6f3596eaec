"""Parts of case files that several tests write."""

STRIP = """
title = "Strip"
[units]
length = "mm"
force = "N"
[mesh]
kind = "box"
lower = [0.0, -10.0]
upper = [20.0, 10.0]
n = [20, 20]
[material]
E = "210 GPa"
nu = 0.3
plane = "strain"
[[cracks]]
kind = "line"
points = [[0.0, 1.0], [6.0, 1.0]]
"""
STRIP_GROWTH = """[growth]
law = { kind = "paris", C = 1e-11, m = 3 }
cycle = { min = 0.1, max = 1.0 }
da = 1.0
max_steps = 2
"""
STRIP_PULL = """[[loads]]
kind = "traction"
where = "top"
value = [0.0, "80 MPa"]
[[loads]]
kind = "traction"
where = "bottom"
value = [0.0, "-80 MPa"]
"""

"""Damaged and hostile files: drawn inputs by class, and the counts of what came of them.

``python -m fuzz.damage 40213`` in the folder `tests`, with a seed and names of classes. Whatever a
file holds, it is read, or refused in words of ours; it never hangs, and older work stays.
"""

import json
import os
import shutil
import sys
import threading
import warnings
from collections import Counter
from functools import cache
from pathlib import Path
from unittest.mock import patch

import numpy as np

import xcrack as xc
from fuzz import scenes
from fuzz.case_entries import CASE, TOML
from fuzz.entry import Input
from fuzz.kinds import EDGE
from fuzz.outcome import BAD, GOOD, Outcome, outcome_of
from support.case_texts import STRIP_PULL
from support.decks import ARCHIVE, box_cases

DATA = Path(__file__).parents[1] / "data"
GROWTH = """
[growth]
law = {kind = "paris", C = 1e-3, m = 2.0}
cycle = {min = 0.0, max = 1.0}
da = 1.0
max_steps = 2
"""
_TOKENS = (
    "nan", "inf", "-1", "1e400", "0", "9" * 400, '"', "[", "]]", "{", "=", ",", "*", "\0", "é",
    "../x", "NaN", "true", "1979-05-27", "#", "", " ", "'''", "-0.0", "1e-320", "99999999999",
    "*INCLUDE, INPUT=x",
)  # fmt: skip


def mutated_text(rng, text):
    """Lines lost, doubled, exchanged, cut; words replaced."""
    lines = text.split("\n")
    for _ in range(int(rng.integers(1, 4))):
        k = int(rng.integers(len(lines)))
        word = str(rng.choice(_TOKENS))
        kind = int(rng.integers(6))
        if kind == 0:
            lines[k : k + 1] = []
        elif kind == 1:
            lines[k : k + 1] = [lines[k], lines[k]]
        elif kind == 2:
            j = int(rng.integers(len(lines)))
            lines[k], lines[j] = lines[j], lines[k]
        elif kind == 3:
            lines[k] = lines[k][: int(rng.integers(1 + len(lines[k])))]
        elif kind == 4:
            parts = lines[k].replace(",", " , ").split(" ")
            parts[int(rng.integers(len(parts)))] = word
            lines[k] = " ".join(parts)
        else:
            lines = lines[:k]
        lines = lines or [""]
    return "\n".join(lines)


def mutated_bytes(rng, data):
    """Bits turned, pieces lost, doubled, blank or of noise, the end cut off."""
    data = bytearray(data)
    for _ in range(int(rng.integers(1, 4))):
        k, n = int(rng.integers(max(len(data), 1))), int(rng.integers(1, 60))
        kind = int(rng.integers(6))
        if kind == 0 and data:
            data[k] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            del data[k : k + n]
        elif kind == 2:
            data[k:k] = data[k : k + n]
        elif kind == 3:
            data[k : k + n] = bytes(len(data[k : k + n]))
        elif kind == 4:
            data[k : k + n] = rng.bytes(n)
        else:
            del data[k:]
    return bytes(data)


def written(name, content):
    """A file in the current folder."""
    path = Path(name)
    path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8", "replace"))
    return path


# Classes: each gives, for a generator, a text of what is tried and a call that tries it -----------


def case_files(rng):
    base = CASE.format(**TOML) + (GROWTH if rng.random() < 0.5 else "")
    content = mutated_text(rng, base) if rng.random() < 0.8 else mutated_bytes(rng, base.encode())
    return "a case file", lambda: xc.read_case(written("case.toml", content)).problem.mesh


@cache
def saved_bytes(kind):
    """What `save` writes of a solution or a history."""
    with scenes.folder() as folder:
        xc.save(scenes.solution() if kind == "solution" else scenes.history(), folder / "x.npz")
        return (folder / "x.npz").read_bytes()


def saved_files(rng):
    kind = str(rng.choice(["solution", "history"]))
    data = mutated_bytes(rng, saved_bytes(kind))
    return f"a saved {kind}", lambda: xc.load(written("x.npz", data))


def run_folders(rng):
    stored = scenes.stored()
    names = sorted(path.name for path in stored.iterdir() if path.is_file())
    name = str(rng.choice(names))
    kind = int(rng.integers(4))

    def call():
        folder = Path("run")
        shutil.copytree(stored, folder)
        path = folder / name
        if kind == 0:
            path.unlink()
        elif kind == 1:
            path.unlink()
            path.mkdir()
        else:
            path.write_bytes(mutated_bytes(rng, path.read_bytes()))
        return xc.load(folder)

    return f"a run whose {name} is {('lost', 'a folder', 'damaged', 'damaged')[kind]}", call


def half(a):
    """A case that takes no time."""
    return {"half": a / 2}


def campaign_rows(rng):
    cases = [{"a": 1.0}, {"a": 2.5}, {"a": 4.0}]
    target = "study.json" if rng.random() < 0.3 else f"row_{int(rng.integers(3))}"
    kind = int(rng.integers(3))

    def call():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", xc.XcrackWarning)
            xc.campaign(half, cases, path="study")
        files = sorted(Path("study").glob("row_*.json"))
        path = files[int(target[-1])] if target != "study.json" else Path("study") / target
        if kind == 0:
            path.unlink()
        elif kind == 1:
            path.write_text(mutated_text(rng, path.read_text()))
        else:
            path.write_bytes(mutated_bytes(rng, path.read_bytes()))
        study = xc.campaign(half, cases, path="study")
        return len(study.table())  # a name that is damaged leaves nan in its column

    return f"a study whose {target} is damaged", call


def decks(rng):
    text = (DATA / str(rng.choice(["assembly.inp", "cube.inp", "plate.inp"]))).read_text()
    content = mutated_text(rng, text)
    read = xc.read_deck if rng.random() < 0.5 else xc.read_mesh

    def call():
        result = read(written("deck.inp", content))
        return result.mesh if isinstance(result, xc.Deck) else result

    return f"a deck for {read.__name__}", call


_ASSESSED = """
[growth]
law = { kind = "metal", name = "2024-T3 sheet, L-T" }
criterion = { kind = "mean_reference", reference = "max" }
da = "1 mm"
until = "right"
[growth.spectrum]
factors = [0.0, 1.0, 0.4, 0.9, 0.0, 0.6]
unit = "flight"
least_range = 0.05
[growth.retardation]
kind = "wheeler"
w = 1.2
zone = { sigma_y = "350 MPa", beta = 2 }
[[retarded]]
kind = "willenborg"
shutoff = 2.5
dK_th = 60.0
zone = { sigma_y = "350 MPa", beta = 2 }
[life]
seed = 3
samples = 400
[life.scatter]
C = { kind = "lognormal", sigma = 0.3 }
a0 = { kind = "normal", sigma = 0.1 }
[inspection]
a_detect = "8 mm"
factor = 3
pod = { a50 = "5 mm", s = 0.3 }
[strength]
K_c = "30 MPa*sqrt(m)"
resistance = { da = [0.0, 5.0], K = [900.0, 1500.0] }
"""
_TABLED = """
[growth]
cycle = { states = [0.0, [{ kind = "traction", where = "top", value = [0.0, "90 MPa"] }]] }
tolerance = 0.02
link_up = { sigma_y = "350 MPa", beta = 2 }
load_program = { kind = "load_over_size", function = [[2.0, 1.0], [9.0, 0.5]] }
[growth.law]
kind = "rate_table"
curves = [{ R = 0.0, dK = [200, 900], rate = [1e-6, 1e-4] }]
outside = "nearest"
[output]
folder = "results"
pictures = ["von_mises"]
[numerics]
points = 6
"""
_SPECIMEN = """
title = "Compact specimen"
[units]
length = "mm"
force = "N"
[specimen]
kind = "middle_tension"
W = 50.0
a = 12.0
size = 4.0
[material]
kind = "metal"
name = "7075-T6 plate, L-T"
plane = "strain"
[[handbook]]
kind = "middle"
W = 25.0
a = 6.0
S = 1.0
[solve]
states = [0.0, 1.0]
error = true
[growth]
law = { kind = "preset", name = "BS 7910 steel in air, mean" }
cycle = { min = 0.1, max = 1.0 }
da = 1.0
"""
_OF_DECK = """
[deck]
path = "deck.inp"
step = 1
[[cracks]]
kind = "line"
points = [[-0.1, 0.5], [0.4, 0.5]]
[[supports]]
kind = "fix"
where = [0.0, 0.0]
[[mesh_free]]
"""


def full_cases(rng):
    """Case files that use all tables."""
    plate = CASE.format(**TOML).replace("[solve]", STRIP_PULL + "[solve]")
    base = [plate + _ASSESSED, plate + _TABLED, _SPECIMEN, _OF_DECK.replace("[[mesh_free]]\n", "")]
    content = mutated_text(rng, base[int(rng.integers(len(base)))])

    def call():
        written("deck.inp", _decks()["CPE3_cload"])
        return xc.read_case(written("case.toml", content)).problem.mesh

    return "a case file of all tables", call


@cache
def _decks():
    """Decks with loads and supports of many kinds, of three programs."""
    texts = {name: text for dim in (2, 3) for name, text in box_cases(dim, 1).items()}
    with scenes.folder() as folder:
        body = folder / "body.bdf"
        import meshio

        mesh = xc.box((0, 0, 0), (1, 1, 1), 1)
        meshio.Mesh(mesh.points, [("tetra", mesh.cells)]).write(body)
        texts["bdf"] = body.read_text()
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    corners += [(x, y, 2) for x, y, _ in corners]
    texts["cdb"] = ARCHIVE.format(nodes="".join(
        f"{n:9d}{0:9d}{0:9d}{x:21.13E}{y:21.13E}{z:21.13E}\n"
        for n, (x, y, z) in enumerate(corners, 1)
    ))  # fmt: skip
    return texts


def full_decks(rng):
    """Decks of three programs: to a problem, or a refusal."""
    texts = _decks()
    name = str(rng.choice([*texts, "cdb", "cdb", "bdf", "bdf"]))
    content = mutated_text(rng, texts[name])
    ending = name if name in ("cdb", "bdf") else "inp"

    def call():
        deck = xc.read_deck(written(f"deck.{ending}", content))
        plane = None if deck.mesh.dim == 3 else "strain"
        return deck.problem(material=xc.Isotropic(1.0, 0.3, plane)).mesh

    return f"a deck {name}", call


_HEADED = "time;factor;note\n" + "\n".join(f"{k};{(k % 5) / 4 - 0.2:.3f};{k}" for k in range(20))
_COUNTED = "# min max count\n" + "\n".join(f"{0.05 * k:.2f}, 1.0, {10 * k + 1}" for k in range(12))


def tables(rng):
    """Load histories and counted cycles as tables."""
    counted = bool(rng.random() < 0.5)
    content = mutated_text(rng, _COUNTED if counted else _HEADED)
    given = {"rows": True} if counted else {"column": 1}
    return "a table", lambda: xc.read_spectrum(written("s.csv", content), **given).cycles["max"]


_MESHES = (
    "plate_22.msh", "plate_41.msh", "plate_22_binary.msh", "plate_41_binary.msh", "order_2.msh",
    "meshio.vtu", "pyvista.vtu", "cube_22.msh", "cube_41.msh",
)  # fmt: skip


def meshes(rng):
    name = str(rng.choice(_MESHES))
    data = mutated_bytes(rng, (DATA / name).read_bytes())
    return f"{name}, damaged", lambda: xc.read_mesh(written(f"x{Path(name).suffix}", data))


def spectra(rng):
    rows = "\n".join(f"{k} {rng.uniform():.4f}" for k in range(12))
    content = mutated_text(rng, "# factors\n" + rows)
    return "a spectrum", lambda: xc.read_spectrum(written("s.txt", content), column=1).factors


_STL = "solid a\n" + "".join(
    f"facet normal 0 0 1\nouter loop\nvertex {k} {k} 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
    "endfacet\n" for k in range(2)
) + "endsolid a\n"  # fmt: skip


def surfaces(rng):
    content = mutated_text(rng, _STL)
    return "a surface", lambda: xc.read_surface(written("s.stl", content)).points


READERS = {
    "read_case": (lambda path: xc.read_case(path).problem.mesh, ".toml"),
    "read_mesh": (xc.read_mesh, ".msh"),
    "read_deck": (lambda path: xc.read_deck(path).mesh, ".inp"),
    "read_spectrum": (lambda path: xc.read_spectrum(path).factors, ".txt"),
    "read_surface": (lambda path: xc.read_surface(path).points, ".stl"),
    "load": (xc.load, ".npz"),
    "mesh_step": (lambda path: xc.mesh_step(path, size=0.5), ".step"),
}


def pipes(rng):
    """Pipes, devices and sockets in the place of files; nobody writes into the pipe."""
    name = str(rng.choice(list(READERS)))
    read, ending = READERS[name]
    kind = str(rng.choice(["pipe", "endless device", "empty device", "link to itself"]))

    def call():
        path = Path(f"x{ending}")
        if kind == "pipe":
            os.mkfifo(path)
        else:
            target = {"endless device": "/dev/zero", "empty device": "/dev/null"}
            path.symlink_to(target.get(kind, path.name))
        return read(path)

    return f"{name} of a {kind}", call


def sizes(rng):
    """Files that claim to hold far more than there is memory."""
    n = int(10.0 ** rng.uniform(8, 17))
    kind = int(rng.integers(4))

    def deck():
        text = (DATA / "cube.inp").read_text()
        return xc.read_mesh(written("x.inp", f"{text}\n*NSET, NSET=A, GENERATE\n1, {n}, 1\n"))

    def mesh():
        text = f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{n}\n1 0 0 0\n$EndNodes\n"
        return xc.read_mesh(written("x.msh", text))

    def array():
        import io
        import zipfile

        head = io.BytesIO()
        np.lib.format.write_array_header_1_0(
            head, {"descr": "<f8", "fortran_order": False, "shape": (n,)}
        )
        with zipfile.ZipFile("x.npz", "w") as file:
            file.writestr("u.npy", head.getvalue())
        return xc.load(Path("x.npz"))

    def body():
        return xc.read_case(
            written("x.toml", CASE.format(**TOML | {"n": f"[{n}, {n}]"}))
        ).problem.mesh

    call = (deck, mesh, array, body)[kind]
    return f"{call.__name__} of {n}", call


def depth(rng):
    """Files that nest or include each other without end."""
    n = int(10.0 ** rng.uniform(2, 5))
    kind = int(rng.integers(4))

    def toml():
        return xc.read_case(written("x.toml", f"a = {'[' * n}{']' * n}\n")).problem.mesh

    def study():
        xc.campaign(half, [{"a": 1.0}], path="study")
        row = next(Path("study").glob("row_*.json"))
        row.write_text("[" * n + "]" * n)
        return xc.campaign(half, [{"a": 1.0}], path="study").table()["half"]

    def include():
        many = min(n, 3000)
        for k in range(many):
            written(f"x{k}.inp", f"*INCLUDE, INPUT=x{k + 1}.inp\n")
        written(f"x{many}.inp", f"*INCLUDE, INPUT={'x0' if rng.random() < 0.5 else 'none'}.inp\n")
        return xc.read_mesh("x0.inp")

    def run():
        shutil.copytree(scenes.stored(), "run")
        file = Path("run") / "run.json"
        file.write_text('{"a":' * n + "1" + "}" * n)
        return xc.load("run")

    call = (toml, study, include, run)[kind]
    return f"{call.__name__} {n} deep", call


def outside(rng):
    """Names in files that lead out of their folder, to nothing, or to a folder."""
    place = str(
        rng.choice(["../../x", "/etc/passwd", "..", "/proc/self/mem", "~", "a/../../b", "."])
    )
    kind = int(rng.integers(3))

    def header():
        shutil.copytree(scenes.stored(), "run")
        file = Path("run") / "run.json"
        value = json.loads(file.read_text())
        names = [k for k, v in value.items() if isinstance(v, str)]
        value[str(rng.choice(names))] = place
        file.write_text(json.dumps(value))
        return xc.load("run")

    def deck():
        return xc.read_mesh(written("x.inp", f"*NODE, INPUT={place}\n*INCLUDE, INPUT={place}\n"))

    def case():
        text = f'[mesh]\nfile = "{place}"\n[material]\nE = 1.0\nnu = 0.3\n'
        return xc.read_case(written("x.toml", text)).problem.mesh

    call = (header, deck, case)[kind]
    return f"{call.__name__} that names {place}", call


def threads(rng):
    """gmsh belongs to a process: bodies from several threads at once are made, or refused."""
    n, size = int(rng.integers(2, 5)), float(rng.uniform(0.3, 0.6))

    def call():
        errors, bodies = [], []

        def make():
            try:
                bodies.append(
                    xc.plate_with_hole(width=2.0, height=2.0, radius=0.3, size=size, size_near=0.2)
                )
            except BaseException as error:
                errors.append(error)

        every = [threading.Thread(target=make) for _ in range(n)]
        for thread in every:
            thread.start()
        for thread in every:
            thread.join()
        if errors:
            raise errors[0]
        return bodies

    return f"plates in {n} threads", call


def step_files(rng):
    data = mutated_bytes(rng, scenes.step_file().read_bytes())
    return "a STEP file", lambda: xc.mesh_step(written("x.step", data), size=0.7)


def reports(rng):
    """A disk that is full after so many bytes: the older page stays, or the new one is whole."""
    room = int(10.0 ** rng.uniform(0, 6))

    def call():
        page = written("page.html", "an older page")
        opened = Path.open

        def full(self, *arguments, **named):
            file = opened(self, *arguments, **named)
            if not file.writable():
                return file
            left, write = [room], file.write

            def limited(text):
                left[0] -= len(text)
                if left[0] < 0:
                    raise OSError(28, "No space left on device")
                return write(text)

            file.write = limited
            return file

        try:
            with patch.object(Path, "open", full):
                xc.report(scenes.solution(), "page.html")
        finally:
            text = page.read_text()
            assert text == "an older page" or text.rstrip().endswith("</html>")
            assert not list(Path().glob(".page*"))

    return f"a report on a disk with {room} bytes", call


CLASSES = {
    full_cases: 400, full_decks: 300, tables: 150,
    case_files: 300, saved_files: 200, run_folders: 150, campaign_rows: 200, decks: 250,
    meshes: 150, spectra: 120, surfaces: 80, pipes: 40, sizes: 60, depth: 40, outside: 60,
    threads: 15, step_files: 8, reports: 12,
}  # fmt: skip


def run(seed, shares=1.0, names=()):
    """Counts by class and outcome, and lines about what must not be."""
    table, faults = {}, []
    for number, (draw, count) in enumerate(CLASSES.items()):
        name = draw.__name__.replace("_", " ")
        if names and draw.__name__ not in names:
            continue
        counts = table.setdefault(name, Counter())
        for k in range(max(1, round(count * shares))):
            text, call = draw(np.random.default_rng([seed, number, k]))
            one = Input(name=name, verdict=EDGE, call=call, text=text, in_folder=True)
            outcome: Outcome = outcome_of(one)
            counts[outcome.kind] += 1
            if outcome.kind in BAD:
                seen = " ".join(outcome.seen.split())[:500]
                faults.append(f"{seed}/{draw.__name__}/{k} {outcome.kind}: {text}: {seen}")
    return table, faults


def report(table):
    """Counts by class as text."""
    kinds = [kind for kind in (*GOOD, *BAD) if any(counts[kind] for counts in table.values())]
    lines = [" | ".join(["class", "inputs", *kinds])]
    for name, counts in table.items():
        cells = [name, sum(counts.values()), *(counts[kind] for kind in kinds)]
        lines.append(" | ".join(map(str, cells)))
    return "\n".join(lines)


if __name__ == "__main__":
    table, faults = run(int(sys.argv[1]), float(sys.argv[2]), sys.argv[3:])
    print(*faults, sep="\n")
    print(report(table))

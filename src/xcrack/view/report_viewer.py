"""An interactive view in a page: WebGL of a few lines, with all that it draws inside the page."""

import base64
import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Floats
from xcrack.base.markup import Markup
from xcrack.mesh.mesh import Mesh
from xcrack.output.curved_sides import CurvedSides
from xcrack.runs.history import History
from xcrack.view.scene_3d import crack_scene, space_scene
from xcrack.view.section_3d import boundary_edges

_SCRIPT = """
(function () {
const data = JSON.parse(document.getElementById("view-data").textContent);
const canvas = document.getElementById("view-canvas"), bar = document.getElementById("view-bar");
const gl = canvas.getContext("webgl", {alpha: false, antialias: true, preserveDrawingBuffer: true});
if (!gl) { bar.textContent = "This browser draws no WebGL: see the pictures."; return; }
gl.getExtension("OES_standard_derivatives");
function shader(kind, text) { const s = gl.createShader(kind); gl.shaderSource(s, text);
  gl.compileShader(s); if (!gl.getShaderParameter(s, gl.COMPILE_STATUS))
  throw new Error(gl.getShaderInfoLog(s)); return s; }
const program = gl.createProgram();
gl.attachShader(program, shader(gl.VERTEX_SHADER, `attribute vec3 place; attribute vec3 colour;
uniform mat4 turn; uniform vec3 middle; uniform float nearer; varying vec3 tint; varying vec3 at;
void main() { vec4 p = turn * vec4(place - middle, 1.0); at = p.xyz; tint = colour;
gl_Position = vec4(p.xy, -0.4 * p.z - nearer, 1.0); }`));
gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `#extension GL_OES_standard_derivatives : enable
precision mediump float; varying vec3 tint; varying vec3 at; uniform float opacity, lit;
void main() { vec3 n = cross(dFdx(at), dFdy(at)); float l = length(n);
float light = lit > 0.5 && l > 0.0 ? 0.55 + 0.45 * abs(n.z / l) : 1.0;
gl_FragColor = vec4(tint * light, opacity); }`));
gl.linkProgram(program); gl.useProgram(program);
const where = n => gl.getUniformLocation(program, n);
const attribute = n => gl.getAttribLocation(program, n);
function bytes(text) { const s = atob(text), a = new Uint8Array(s.length);
  for (let i = 0; i < s.length; i++) a[i] = s.charCodeAt(i); return a; }
function buffer(content) { const b = gl.createBuffer(); gl.bindBuffer(gl.ARRAY_BUFFER, b);
  gl.bufferData(gl.ARRAY_BUFFER, content, gl.STATIC_DRAW); return b; }
let last = -1;
for (const layer of data.layers) {
  const places = new Uint16Array(bytes(layer.places).buffer);
  layer.count = places.length / 3; layer.on = true; last = Math.max(last, layer.step);
  layer.place = buffer(places); layer.colour = buffer(bytes(layer.colours));
}
let step = last;
const names = [...new Set(data.layers.map(l => l.name))];
for (const name of names) {
  const mine = data.layers.filter(l => l.name === name), label = document.createElement("label");
  const box = document.createElement("input"); box.type = "checkbox"; box.checked = true;
  box.onchange = () => { mine.forEach(l => l.on = box.checked); draw(); };
  label.append(box, " " + name + " ");
  if (mine[0].opacity < 1) { const range = document.createElement("input"); range.type = "range";
    range.min = 0.05; range.max = 1; range.step = 0.05; range.value = mine[0].opacity;
    range.oninput = () => { mine.forEach(l => l.opacity = +range.value); draw(); };
    label.append(range); }
  bar.append(label);
}
if (last > 0) { const label = document.createElement("label"), out = document.createElement("b");
  const range = document.createElement("input"); range.type = "range"; range.min = 0;
  range.max = last; range.value = last; out.textContent = last;
  range.oninput = () => { step = +range.value; out.textContent = step; draw(); };
  label.append(" step ", range, out); bar.append(label); }
let yaw = -0.6, pitch = -1.1, zoom = 1.1, moveX = 0, moveY = 0;
function draw() {
  const w = canvas.clientWidth, h = canvas.clientHeight, ratio = window.devicePixelRatio || 1;
  canvas.width = w * ratio; canvas.height = h * ratio;
  gl.viewport(0, 0, canvas.width, canvas.height);
  const cy = Math.cos(yaw), sy = Math.sin(yaw), cp = Math.cos(pitch), sp = Math.sin(pitch);
  const x = zoom * Math.min(1, h / w), y = zoom * Math.min(1, w / h);
  gl.uniformMatrix4fv(where("turn"), false, [x * cy, y * cp * sy, sp * sy, 0,
    -x * sy, y * cp * cy, sp * cy, 0, 0, -y * sp, cp, 0, moveX, moveY, 0, 1]);
  gl.uniform3fv(where("middle"), data.middle);
  gl.clearColor(1, 1, 1, 1); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  const shown = data.layers.filter(l => l.on && (l.step < 0 || l.step === step));
  shown.sort((a, b) => b.opacity - a.opacity);
  for (const l of shown) {
    const clear = l.opacity < 1; clear ? gl.enable(gl.BLEND) : gl.disable(gl.BLEND);
    gl.depthMask(!clear); gl.uniform1f(where("opacity"), l.opacity);
    gl.uniform1f(where("lit"), l.kind === "triangles" ? 1 : 0);
    gl.uniform1f(where("nearer"), l.kind === "triangles" ? 0 : 0.004);
    gl.bindBuffer(gl.ARRAY_BUFFER, l.place); gl.enableVertexAttribArray(attribute("place"));
    gl.vertexAttribPointer(attribute("place"), 3, gl.UNSIGNED_SHORT, true, 0, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, l.colour); gl.enableVertexAttribArray(attribute("colour"));
    gl.vertexAttribPointer(attribute("colour"), 3, gl.UNSIGNED_BYTE, true, 0, 0);
    gl.drawArrays(l.kind === "triangles" ? gl.TRIANGLES : gl.LINES, 0, l.count);
  }
  gl.depthMask(true); canvas.dataset.drawn = shown.length;
}
canvas.onpointerdown = e => canvas.setPointerCapture(e.pointerId);
canvas.onpointermove = e => { if (!e.buttons) return;
  if (e.shiftKey || e.buttons > 1) { moveX += 2 * e.movementX / canvas.clientWidth;
    moveY -= 2 * e.movementY / canvas.clientHeight; }
  else { yaw += e.movementX / 150; pitch += e.movementY / 150; } draw(); };
canvas.oncontextmenu = e => e.preventDefault();
canvas.onwheel = e => { e.preventDefault(); zoom *= Math.exp(-e.deltaY / 600); draw(); };
window.addEventListener("resize", draw); draw();
})();
"""


def viewer(content: dict[str, Any]) -> Markup:
    """The view, its data and its script."""
    data = json.dumps(content).replace("<", "\\u003c")
    return Markup(
        '<p class="soft">Drag to turn, wheel to zoom, shift and drag to move.</p>'
        '<div id="view-bar"></div><canvas id="view-canvas"></canvas>'
        f'<script type="application/json" id="view-data">{data}</script>'
        f"<script>{_SCRIPT}</script>"
    )


# --- what an interactive view of a body in space shows: layers of triangles and lines, packed ---


MOST = 250_000  # triangles that are packed; seven bytes a corner
_GREY, _EDGE = (143, 163, 184), (64, 64, 64)
_CRACK, _FRONT, _JUNCTION = (214, 96, 77), (178, 24, 43), (123, 50, 148)


def solution_layers(solution: Solution) -> list[dict[str, Any]]:
    """Surface of the body coloured by its equivalent stress, cracks, fronts and edges."""
    body = space_scene(solution, "von_mises", 0.0, None, None, None)
    layers = [
        _layer("body: equivalent stress", "triangles", body.triangles,
               _coloured_layer(body.values, body.limits), 0.35),
        _layer("edges", "lines", body.outline, _EDGE, 1.0),
    ]  # fmt: skip
    if solution.lips:
        cracks = list(range(len(solution.lips)))
        lips = crack_scene(solution, "opening", cracks, 0.0, None, None, None)
        layers += [
            _layer("crack: opening", "triangles", lips.triangles,
                   _coloured_layer(lips.values, lips.limits), 1.0),
            _layer("crack: faces that touch", "triangles", lips.closed_faces, (110, 110, 110), 1.0),
            _layer("fronts", "lines", lips.fronts, _FRONT, 1.0),
            _layer("junctions", "lines", lips.junctions, _JUNCTION, 1.0),
        ]  # fmt: skip
    return [layer for layer in layers if layer["n"]]


def history_layers(history: History) -> list[dict[str, Any]]:
    """The body as far as it is known, and the cracks of each step."""
    layers = [] if history.mesh is None else _body(history.mesh)
    for step in history.steps:
        surface = [crack.points[crack.faces] for crack in step.cracks]
        fronts = [
            np.stack([crack.points[front[:-1]], crack.points[front[1:]]], axis=1)
            for crack in step.cracks
            for front in crack.fronts or ()
            if len(front) > 1
        ]
        for name, kind, parts, colour, shape in (
            ("cracks", "triangles", surface, _CRACK, (0, 3, 3)),
            ("fronts", "lines", fronts, _FRONT, (0, 2, 3)),
        ):
            corners = np.concatenate([np.zeros(shape), *parts])
            layers.append({**_layer(name, kind, corners, colour, 1.0), "step": step.index})
    return [layer for layer in layers if layer["n"]]


def packed_layers(layers: Sequence[dict[str, Any]]) -> dict[str, Any] | None:
    """Layers in one box, as text for a page; None where there is nothing, or too much."""
    triangles = sum(layer["n"] for layer in layers if layer["kind"] == "triangles")
    if not layers or triangles > MOST:
        return None
    corners = np.concatenate([layer["corners"].reshape(-1, 3) for layer in layers])
    x_min = corners.min(axis=0)
    extent = float(np.ptp(corners, axis=0).max()) or 1.0
    content = []
    for layer in layers:
        share = (layer["corners"].reshape(-1, 3) - x_min) / extent
        places = np.round(share * 65535).astype("<u2")
        colours = np.asarray(layer["colours"], dtype=np.uint8)
        if colours.ndim == 1:
            colours = np.broadcast_to(colours, (len(places), 3))
        content.append({
            **{key: layer[key] for key in ("name", "kind", "opacity")},
            "step": layer.get("step", -1),
            "places": _text(places), "colours": _text(np.ascontiguousarray(colours)),
        })  # fmt: skip
    middle = np.ptp(corners, axis=0) / extent / 2
    return {"layers": content, "middle": middle.tolist(), "extent": extent}


def _layer(name: str, kind: str, corners: Floats, colours: Any, opacity: float) -> dict[str, Any]:
    return {"name": name, "kind": kind, "corners": corners, "colours": colours,
            "opacity": opacity, "n": len(corners)}  # fmt: skip


def _body(mesh: Mesh) -> list[dict[str, Any]]:
    curved_sides = CurvedSides.of(mesh)
    pairs, facet, is_sharp = boundary_edges(mesh, curved_sides)
    skin, edges = mesh.points[mesh.boundary], mesh.points[pairs[is_sharp]]
    if curved_sides is not None:
        skin = curved_sides.on_curves(skin, np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0])
        edges = curved_sides.on_curves(edges, facet[is_sharp])
    return [
        _layer("body", "triangles", skin, _GREY, 0.25),
        _layer("edges", "lines", edges, _EDGE, 1.0),
    ]


def _coloured_layer(values: Floats, limits: tuple[float, float]) -> Any:
    from matplotlib import colormaps

    v_min, v_max = limits
    share = np.clip((values.ravel() - v_min) / ((v_max - v_min) or 1.0), 0, 1)
    return np.asarray(255 * colormaps["viridis"](share)[:, :3], dtype=np.uint8)


def _text(array: Any) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()


__all__ = ["MOST", "history_layers", "packed_layers", "solution_layers", "viewer"]

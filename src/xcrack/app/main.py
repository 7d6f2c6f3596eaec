"""Arguments of the command `xcrack`, and the public functions that they call."""

import argparse
import runpy
import sys
from collections.abc import Sequence
from pathlib import Path

import xcrack
from xcrack.base.errors import XcrackError

_EPILOG = "Each command is a public function of the same name: see help(xcrack.verify)."


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the process if left out.

    Returns
    -------
    int
        Exit status: 0, 1 where a case of the book fails, 2 where the input is wrong, 130 after
        Ctrl-C.
    """
    options = _parser().parse_args(arguments)
    try:
        return int(options.command(options))
    except XcrackError as error:
        print(f"xcrack: {error}", file=sys.stderr)
        for note in getattr(error, "__notes__", ()):
            print(f"xcrack: {note}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("xcrack: interrupted", file=sys.stderr)
        return 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="xcrack",
        description="Fatigue crack growth by extended finite elements.",
        epilog=_EPILOG,
    )
    parser.add_argument("--version", action="version", version=f"xcrack {xcrack.__version__}")
    commands = parser.add_subparsers(required=True, metavar="command")

    def add(name: str, function: object, words: str) -> argparse.ArgumentParser:
        subparser = commands.add_parser(
            name, help=words, description=words[0].upper() + words[1:] + "."
        )
        subparser.set_defaults(command=function)
        return subparser

    subparser = add("info", _info, "versions, solvers, renderers, what is missing")
    subparser.add_argument("--warm", action="store_true", help="compile the kernels now")
    subparser = add("demo", _demo, "a closed crack at a hole, with a report")
    subparser.add_argument("folder", nargs="?", default="xcrack_demo", help="where the report goes")
    subparser = add("run", _run, "solve or grow what a case file tells")
    subparser.add_argument("case", type=Path, help="a toml file")
    subparser.add_argument(
        "--resume", action="store_true", help="go on with the steps that are there"
    )
    subparser.add_argument(
        "--overwrite", action="store_true", help="begin anew, move old steps aside"
    )
    subparser = add("sweep", _sweep, "run a case file for many values of some keys")
    subparser.add_argument("case", type=Path, help="a toml file")
    subparser.add_argument(
        "--set",
        dest="values",
        action="append",
        required=True,
        metavar="KEY=A,B,...",
        help="such as cracks.0.radius=1,2,3; several: all combinations",
    )
    subparser.add_argument("--workers", type=int, default=1, help="processes")
    subparser.add_argument("--retry", action="store_true", help="run those again that failed")
    subparser.add_argument("-o", "--output", type=Path, help="folder; left out: beside the file")
    subparser = add("report", _report, "report of a growth run from its folder")
    subparser.add_argument("folder", type=Path, help="the folder of the run")
    subparser.add_argument(
        "-o", "--output", type=Path, help="the page; left out: report.html in it"
    )
    subparser.add_argument("--yield-stress", type=float, help="to judge plastic zones by")
    subparser.add_argument("--units", help='of all tables, such as "N, mm, MPa"')
    subparser = add("plot", _plot, "picture of a growth run from its folder")
    subparser.add_argument("folder", type=Path, help="the folder of the run")
    subparser.add_argument("kind", nargs="?", default="a", help="K, a, path, fronts or measures")
    subparser.add_argument("-o", "--output", type=Path, help="the figure; left out: kind.png in it")
    subparser = add("life", _life, "lives, inspections and strength of a stored growth run")
    subparser.add_argument("folder", type=Path, help="the folder of the run")
    subparser.add_argument(
        "--scatter",
        type=float,
        metavar="SIGMA",
        required=True,
        help="of ln C: standard deviation of the logarithm of the growth rate",
    )
    subparser.add_argument("--samples", type=int, default=100_000)
    subparser.add_argument("--seed", type=int, default=1, help="of the draw")
    subparser.add_argument("--unit", default="cycle", help="what a cycle is called, such as flight")
    subparser.add_argument(
        "--detect", type=float, metavar="A", help="length that a look finds for sure"
    )
    subparser.add_argument("--factor", type=float, default=2.0, help="looks from there to the end")
    subparser.add_argument(
        "--interval", type=float, metavar="N", help="cycles between looks instead"
    )
    subparser.add_argument(
        "--pod",
        type=float,
        nargs=2,
        metavar=("A50", "S"),
        help="of a logistic probability of detection: chance that all looks miss",
    )
    subparser.add_argument(
        "--toughness", type=float, metavar="K_C", help="for the residual strength"
    )
    subparser.add_argument("--nu", type=float, help="Poisson's ratio, with --toughness")
    subparser.add_argument("-o", "--output", type=Path, help="write a report with these sections")
    subparser = add("verify", _verify, "compare this installation with what is known")
    subparser.add_argument(
        "--quick", action="store_true", help="coarsest meshes of the quick cases"
    )
    subparser.add_argument("-k", dest="only", default="", metavar="NAME", help="cases of this name")
    subparser.add_argument("-o", "--output", type=Path, help="write the book as a page")
    subparser = add("validate", _validate, "predict tests that others made")
    subparser.add_argument(
        "--quick", action="store_true", help="coarse cells and long steps, in the plane"
    )
    subparser.add_argument("-k", dest="only", default="", metavar="NAME", help="tests of this name")
    subparser.add_argument("-o", "--output", type=Path, help="write the page, keep each result")
    subparser.add_argument(
        "--data", type=Path, metavar="FOLDER", help="with measured numbers that are not free"
    )
    subparser = add("chart", _chart, "error against time of a scene")
    subparser.add_argument("scene", type=Path, help="a script that makes `problem`, or a case file")
    subparser.add_argument(
        "-o", "--output", type=Path, help="the figure; left out: chart.png beside it"
    )
    subparser.add_argument("--seconds", type=float, default=60.0, help="time that it may take")
    subparser = add("mesh", _mesh, "convert a mesh from one file to another")
    subparser.add_argument("source", type=Path)
    subparser.add_argument("target", type=Path)
    return parser


def _info(options: argparse.Namespace) -> int:
    print(xcrack.info(warm=options.warm))
    return 0


def _demo(options: argparse.Namespace) -> int:
    path = xcrack.demo(options.folder, progress="always")
    print(f"the report is {path.resolve()}")
    return 0


def _run(options: argparse.Namespace) -> int:
    result = xcrack.run(options.case, resumed=options.resume, overwrite=options.overwrite)
    print(result if not isinstance(result, list) else "\n".join(map(str, result)))
    print(f"results are in {xcrack.read_case(options.case).folder.resolve()}")
    return 0


def _sweep(options: argparse.Namespace) -> int:
    from xcrack.app.sweep import values_of

    values = dict(values_of(text) for text in options.values)
    study = xcrack.sweep(
        options.case, values, folder=options.output, workers=options.workers, retry=options.retry
    )
    rows = study.table()
    shown_names = [name for name in rows.dtype.names or () if name not in ("seconds", "folder")]
    print("  ".join(shown_names))
    for row in rows:
        print("  ".join(f"{v:.6g}" if isinstance(v, float) else str(v)
                        for v in (row[name] for name in shown_names)))  # fmt: skip
    print(study)
    return 1 if study.failed else 0


def _report(options: argparse.Namespace) -> int:
    target = options.output or options.folder / "report.html"
    path = xcrack.report(options.folder, target, yield_stress=options.yield_stress,
                         units=options.units)  # fmt: skip
    print(f"the report is {path.resolve()}")
    return 0


def _plot(options: argparse.Namespace) -> int:
    target = options.output or options.folder / f"{options.kind}.png"
    xcrack.load(options.folder).plot(options.kind, target)
    print(f"the figure is {target.resolve()}")
    return 0


def _life(options: argparse.Namespace) -> int:
    history = xcrack.load(options.folder)
    scatter = xcrack.Scatter(C=xcrack.lognormal(options.scatter))
    life = xcrack.life(history, scatter=scatter, samples=options.samples, seed=options.seed,
                       unit=options.unit)  # fmt: skip
    print(life)
    plan = strength = None
    if options.detect is not None or options.interval is not None:
        pod = None if options.pod is None else xcrack.logistic_pod(*options.pod)
        plan = xcrack.inspection(history, a_detect=options.detect, factor=options.factor,
                                 interval=options.interval, pod=pod)  # fmt: skip
        print(f"first look after {plan.first:.6g}, then every {plan.interval:.6g} {options.unit}s: "
              f"{len(plan.at)} looks")  # fmt: skip
        if plan.missed is not None:
            print(f"chance that all of them miss: {plan.missed:.3g}")
    elif options.pod is not None:
        raise XcrackError("life: --pod belongs to looks: give --detect or --interval too.")
    if options.toughness is not None:
        if options.nu is None:
            raise XcrackError("life: --toughness needs Poisson's ratio for K_eq: give --nu.")
        strength = xcrack.residual_strength(history, nu=options.nu, K_c=options.toughness)
        factors = strength["by_toughness"]
        print(f"factor on the largest load: {factors[0]:.4g} at first, {factors[-1]:.4g} at last")
    if options.output is not None:
        path = xcrack.report(options.folder, options.output, life=life, inspection=plan,
                             strength=strength)  # fmt: skip
        print(f"the report is {path.resolve()}")
    return 0


def _verify(options: argparse.Namespace) -> int:
    book = xcrack.verify(options.only, quick=options.quick, file=options.output)
    print(str(book).rpartition("s\n")[2] if book.passed else book)
    count = len(book.results)
    print(f"{count} cases in {book.seconds:.0f} s: " + ("all right" if book.passed else "FAILED"))
    return 0 if book.passed else 1


def _validate(options: argparse.Namespace) -> int:
    result = xcrack.validate(
        options.only, quick=options.quick, file=options.output, data=options.data
    )
    print(str(result).rpartition("\n")[2] if result.passed else result)
    return 0 if result.passed else 1


def _chart(options: argparse.Namespace) -> int:
    target = options.output or options.scene.with_name("chart.png")
    chart = xcrack.chart(_problem(options.scene), file=target, seconds=options.seconds)
    print(chart)
    print(f"the figure is {target.resolve()}")
    return 0


def _problem(path: Path) -> object:
    """The problem of a script, or of a case file."""
    if path.suffix == ".toml":
        return xcrack.read_case(path).problem
    if not path.is_file():
        raise XcrackError(f"there is no file {path}.")
    names = runpy.run_path(str(path))
    if "problem" not in names:
        raise XcrackError(f"{path} makes nothing that is called `problem`.")
    return names["problem"]


def _mesh(options: argparse.Namespace) -> int:
    print(xcrack.convert_mesh(options.source, options.target))
    return 0


__all__ = ["main"]

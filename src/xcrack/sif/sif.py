"""Stress intensity factors at the tips or along the fronts of one crack."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from xcrack.base import markup
from xcrack.base.arguments import Number, check_arguments
from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.base.checks import build_without_checks, numbers, value_text, whole_numbers
from xcrack.base.errors import ProblemError
from xcrack.base.optional import require_package

# Estimated errors of K, with a reason where there is none.


@dataclass(frozen=True, eq=False)
class KErrors:
    """Estimated errors of K of one crack in one state.

    Attributes
    ----------
    eta : (f, 2 or 3) array, stress · √length
        Signed estimate of exact K less K; nan where there is none.
    bar : (f, 2 or 3) array, stress · √length
        Half-width of the error of K + eta; nan where there is none.
    reasons : tuple of str
        One a place: why there is no estimate, empty where there is one.
    contact : (f, 2 or 3) array, optional, stress · √length
        Part of `bar` that contact of the faces has: its end, overlaps it is blind to, closed tips.
    """

    eta: Floats
    bar: Floats
    reasons: tuple[str, ...]
    contact: Floats | None = None


def at_stations(answers: Sequence[Sequence["SIF"]], name: str) -> Floats:
    """Values of all states and cracks `(s, n, ...)`, by the name of an attribute."""
    rows = [np.concatenate([getattr(sif, name) for sif in state]) for state in answers]
    return np.stack(rows)


def no_bars(shape: tuple[int, ...], reason: str) -> KErrors:
    """No estimate at any place, for one reason."""
    nothing = lock(np.full(shape, np.nan))
    return KErrors(nothing, nothing, (reason,) * shape[0])


def bars_of(
    eta: Floats, bar: Floats, reasons: Sequence[str], contact: Floats | None = None
) -> KErrors:
    """Estimates with nan where there is a reason against them."""
    has_reason = np.array([bool(reason) for reason in reasons], dtype=bool)[:, None]
    part = None if contact is None else lock(np.where(has_reason, np.nan, contact))
    return KErrors(
        lock(np.where(has_reason, np.nan, eta)),
        lock(np.where(has_reason, np.nan, bar)),
        tuple(reasons),
        part,
    )


@dataclass(frozen=True, eq=False)
class SurfaceEnd:
    """Where a front comes to a free surface, at which K has no limit.

    The exponent of the stresses at that corner is not 1/2: K goes to zero or grows without bound,
    slowly, so that only K at a depth, or over a length, is a number.

    Attributes
    ----------
    front : int
        Which front.
    x : (3,) array, length
        The corner.
    depth : float, length
        Distance along the front from there to where K is read.
    K : (3,) array, stress · √length
        There.
    width : float, length
        Of the hat at the end of the front.
    mean : (3,) array, stress · √length
        Mean of K over that hat, which falls from the corner to zero over its width.
    """

    front: int
    x: Floats
    depth: float
    K: Floats
    width: float
    mean: Floats


@dataclass(frozen=True, eq=False)
class SIF:
    """Stress intensity factors of one crack.

    Attributes
    ----------
    x : (f, d) array, length
        Tips in the order of the crack's points, mouths left out; in 3D vertices of the fronts
        inside the body, and where fronts leave it, in the direction of the last row of their
        frames.
    frame : (f, d, d) array
        Rows (ahead, normal), in 3D (ahead, normal, ahead x normal).
    K : (f, 2 or 3) array, stress · √length
        Columns I, II and in 3D III; K_II is positive for a positive shear in the frame
        (ahead, normal), K_III for one in (ahead x normal, normal).
    T : (f,) array, stress
        Stress along the crack faces (lips); nan in 3D, where it is not computed.
    spread : (f, 2 or 3) array, stress · √length
        Difference between two domains; of K_I at closed places, what the integral gave there.
    s : (f,) array, length
        Position along the front; zero in 2D.
    front : (f,) array of int
        Which tip or front.
    at_surface : (f,) array of bool
        Places so close to a side of the body that K there is that of another place: at a free
        surface that at a depth (`ends`), beside a side that is held the nearest that is known, and
        where the front passes into another material that of a cell away. Never in 2D.
    closed : (f,) array of bool
        Places up to which the crack faces press together: K_I is exactly zero there. Never so on a
        crack without multipliers.
    domain_cells : (f,) array
        Outer radius of the larger domain, in cells; few of them mean a domain that is clipped.
    errors : KErrors, optional
        Estimated errors, where they were asked for.
    ends : tuple of SurfaceEnd
        Where fronts come to free surfaces; none in 2D.
    widened : (f, d) array, stress · √length, optional
        In 3D: difference of K to that of hats along the front which are twice as wide.
    smooth_K : (f, 2, d) array, stress · √length, optional
        In 3D: K of the largest and the smallest domain on smooth curves along the front; error
        bars are about the first.
    E_prime, nu : (f,) arrays, optional
        Of the material there: E / (1 - nu²), in plane stress E (stress), and Poisson's ratio.

    Raises
    ------
    ProblemError
        Arrays of other types, or that do not fit each other.
    """

    x: Floats
    frame: Floats
    K: Floats
    T: Floats
    spread: Floats
    s: Floats
    front: Ints
    at_surface: Bools
    closed: Bools
    domain_cells: Floats
    errors: KErrors | None = None
    ends: tuple[SurfaceEnd, ...] = ()
    widened: Floats | None = None
    smooth_K: Floats | None = None
    E_prime: Floats | None = None
    nu: Floats | None = None

    def __post_init__(self) -> None:
        x = numbers(self.x, "SIF: x", (None, None))
        n, d = x.shape
        if d not in (2, 3):
            raise ProblemError(f"SIF: x has the shape {x.shape}: give (n, 2) or (n, 3).")
        numbers(self.frame, "SIF: frame", (n, d, d))
        for name in ("K", "spread"):
            numbers(getattr(self, name), f"SIF: {name}", (n, d), must_be_finite=False)
        for name in ("T", "s", "domain_cells"):
            numbers(getattr(self, name), f"SIF: {name}", (n,), must_be_finite=False)
        whole_numbers(self.front, "SIF: front", (n,))
        for name in ("at_surface", "closed"):
            flags = getattr(self, name)
            if not isinstance(flags, np.ndarray) or flags.dtype != bool or flags.shape != (n,):
                raise ProblemError(
                    f"SIF: {name} = {value_text(flags)}: give an array of bool of shape ({n},)."
                )
        for name, shape in (
            ("widened", (n, d)), ("smooth_K", (n, 2, d)), ("E_prime", (n,)), ("nu", (n,))
        ):  # fmt: skip
            if getattr(self, name) is not None:
                numbers(getattr(self, name), f"SIF: {name}", shape, must_be_finite=False)
        if self.errors is not None and not isinstance(self.errors, KErrors):
            raise ProblemError(f"SIF: errors = {value_text(self.errors)}: give KErrors or None.")
        is_tuple = isinstance(self.ends, tuple)
        if not is_tuple or not all(isinstance(end, SurfaceEnd) for end in self.ends):
            raise ProblemError(f"SIF: ends = {value_text(self.ends)}: give a tuple of SurfaceEnd.")

    @property
    def eta(self) -> Floats:
        """Signed estimate of exact K less K `(f, 2 or 3)`, nan where there is none: `reasons`."""
        return self._errors.eta

    @property
    def bar(self) -> Floats:
        """Half-width of the error of `best` `(f, 2 or 3)`, nan where there is none: `reasons`."""
        return self._errors.bar

    @property
    def best(self) -> Floats:
        """K + eta `(f, 2 or 3)`, nan where there is no estimate."""
        return self.K + self.eta

    @property
    def has_best(self) -> Bools:
        """Places where `best` is known in all modes `(f,)`: growth follows it there, else K."""
        if self.errors is None:
            return np.zeros(len(self.K), dtype=bool)
        return np.asarray(np.isfinite(self.best).all(axis=1))

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why there is no estimate at a place, empty where there is one; one a place."""
        return self._errors.reasons

    @property
    def _errors(self) -> KErrors:
        if self.errors is not None:
            return self.errors
        return no_bars(self.K.shape, "no estimate was asked for: stress_intensity(error=True)")

    @property
    def K_I(self) -> Floats:
        """Opening mode `(f,)`."""
        return self.K[:, 0]

    @property
    def K_II(self) -> Floats:
        """Sliding mode `(f,)`."""
        return self.K[:, 1]

    @property
    def K_III(self) -> Floats:
        """Tearing mode `(f,)`; zero in 2D."""
        return self.K[:, 2] if self.K.shape[1] > 2 else np.zeros(len(self.K))

    @property
    def K_integral(self) -> Floats:
        """K as the integrals gave it `(f, 2 or 3)`: its K_I of closed places, without sign."""
        K = np.array(self.K)
        K[self.closed, 0] = self.spread[self.closed, 0]
        return K

    @check_arguments()
    def scaled(self, factor: Annotated[float, Number()]) -> "SIF":
        """K under loads times a factor, where all is in proportion to them."""

        def times(values: Floats | None) -> Any:
            return None if values is None else lock(factor * values)

        errors = self.errors
        if errors is not None:
            eta, bar, contact = (times(x) for x in (errors.eta, errors.bar, errors.contact))
            errors = KErrors(eta, bar, errors.reasons, contact)
        return replace(
            self,
            K=times(self.K),
            T=times(self.T),
            spread=times(self.spread),
            errors=errors,
            ends=tuple(replace(e, K=times(e.K), mean=times(e.mean)) for e in self.ends),
            widened=times(self.widened),
            smooth_K=times(self.smooth_K),
        )

    def to_pandas(self) -> Any:
        """All values as a table of pandas: a row for each tip or place.

        Returns
        -------
        pandas.DataFrame
            Columns front, s, x, y[, z], K_I, K_II[, K_III], T, spread_I and so on, at_surface,
            closed, domain_cells.

        Raises
        ------
        XcrackError
            pandas is not installed.
        """
        return require_package("pandas", "SIF.to_pandas").DataFrame(self._columns())

    def _columns(self) -> dict[str, Any]:
        modes = ("I", "II", "III")[: self.K.shape[1]]
        return {
            "front": self.front,
            "s": self.s,
            **{name: self.x[:, i] for i, name in enumerate("xyz"[: self.x.shape[1]])},
            **{f"K_{mode}": self.K[:, m] for m, mode in enumerate(modes)},
            "T": self.T,
            **{f"spread_{mode}": self.spread[:, m] for m, mode in enumerate(modes)},
            "at_surface": self.at_surface,
            "closed": self.closed,
            "domain_cells": self.domain_cells,
        }

    def _repr_html_(self) -> str:
        columns = self._columns()
        rows = list(zip(*(np.asarray(c).tolist() for c in columns.values()), strict=True))
        content = markup.table(tuple(columns), rows, scroll=len(rows) > 12)
        return markup.join_parts(markup.element("b", "SIF"), content)

    def __repr__(self) -> str:
        if self.K.shape[1] == 3:
            return self._values_along()
        rows = ", ".join(
            f"({k[0]:.6g}, {k[1]:.6g}){' is_closed' if is_closed else ''}"
            for k, is_closed in zip(self.K, self.closed, strict=True)
        )
        return f"SIF(K = [{rows}]{self._bars()})"

    def __str__(self) -> str:
        """In 3D with the values along the fronts."""
        if self.K.shape[1] < 3 or not len(self.K):
            return repr(self)
        columns = self._columns()
        names = ["front", "s", "x", "y", "z", "K_I", "K_II", "K_III"]
        values = {name: columns[name].tolist() for name in names}
        if self.errors is not None:
            values["bar of K_I"] = self.bar[:, 0].tolist()
        notes = [
            " ".join([*["closed"] * bool(closed), *["at a surface"] * bool(at_surface)])
            for closed, at_surface in zip(self.closed, self.at_surface, strict=True)
        ]
        if any(notes):
            values[""] = notes
        rows = list(zip(*values.values(), strict=True))
        return f"{self!r}\n{markup.text_table(list(values), rows)}"

    def _values_along(self) -> str:
        if not len(self.K):
            return "SIF(no front)"
        K_min, K_max = self.K.min(axis=0), self.K.max(axis=0)
        modes = zip(("K_I", "K_II", "K_III"), K_min, K_max, strict=True)
        ranges = ", ".join(f"{name} {a:.6g} to {b:.6g}" for name, a, b in modes)
        notes = "".join(
            f", {np.count_nonzero(rows)} {name}"
            for name, rows in (("closed", self.closed), ("at a surface", self.at_surface))
            if rows.any()
        )
        fronts = len(np.unique(self.front))
        return f"SIF({len(self.K)} places on {fronts} front(s){notes}: {ranges}{self._bars()})"

    def _bars(self) -> str:
        """Best K with its bars for printing; along fronts the longest bars alone."""
        if self.errors is None or not len(self.K):
            return ""
        if self.K.shape[1] == 3:
            is_finite = np.isfinite(self.bar).all(axis=1)
            longest_bars = self.bar[is_finite].max(
                axis=0, initial=np.nan if not is_finite.any() else 0.0
            )
            return f"; bars of the best up to {', '.join(f'{b:.2g}' for b in longest_bars)}"
        rows = [
            reason or ", ".join(f"{k:.6g} ± {b:.2g}" for k, b in zip(best, bar, strict=True))
            for best, bar, reason in zip(self.best, self.bar, self.reasons, strict=True)
        ]
        return f", best = [{', '.join(f'({row})' for row in rows)}]"


def joined_sif(parts: Sequence[SIF], dim: int) -> SIF:
    """K of all tips or fronts of one crack.

    Parameters
    ----------
    parts : sequence of SIF
        One for each tip or front; their number becomes that of the front.
    dim : int
        Of the body: a crack may have no tip.
    """
    if len(parts) == 1 and not parts[0].front.any():
        for values in vars(parts[0]).values():
            if isinstance(values, np.ndarray):
                lock(values)
        return parts[0]
    count = [len(part.K) for part in parts]

    def rows(name: str, *shape: int) -> Any:
        """Values of all parts one behind the other; None where a part has none."""
        values = [getattr(part, name) for part in parts]
        given_values = [value for value in values if value is not None]
        if len(given_values) < len(values):
            return None
        return lock(np.concatenate([np.zeros((0, *shape)), *given_values]))

    return build_without_checks(
        SIF,
        x=rows("x", dim),
        frame=rows("frame", dim, dim),
        K=rows("K", dim),
        T=rows("T"),
        spread=rows("spread", dim),
        s=rows("s"),
        front=lock(np.repeat(np.arange(len(parts)), count)),
        at_surface=lock(rows("at_surface").astype(bool)),
        closed=lock(rows("closed").astype(bool)),
        domain_cells=rows("domain_cells"),
        ends=tuple(replace(end, front=f) for f, part in enumerate(parts) for end in part.ends),
        widened=rows("widened", dim),
        smooth_K=rows("smooth_K", 2, dim),
        E_prime=rows("E_prime"),
        nu=rows("nu"),
    )


__all__ = []

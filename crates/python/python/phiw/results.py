"""What identification gives: values that print, pickle and are written."""

from __future__ import annotations

import html
import json
import os
import pathlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional, Sequence, Union

import numpy as np

from . import _phiw
from ._phiw import InputError

if TYPE_CHECKING:
    from .sessions import Logs

PathLike = Union[str, "os.PathLike[str]"]
#: Standard deviations to each side that 95 % of a normal distribution lie in.
BAND_95 = 1.959964
#: The files of a result folder.
FILES = ("model.json", "report.json", "report.html", "identified.urdf", "identified.xml")


def frame(rows: Union[List[Dict[str, Any]], Mapping[str, np.ndarray]]) -> Any:
    """A DataFrame if pandas is installed, else the rows (or columns) as they are."""
    try:
        import pandas  # type: ignore[import-untyped,unused-ignore]
    except ImportError:
        return rows
    return pandas.DataFrame(rows)


@dataclass(frozen=True)
class TorqueErrors:
    """How far predicted torques are from measured ones."""

    #: RMS of the error of each joint (N·m, N).
    rmse: Dict[str, float]
    #: RMS of the error over RMS of the torque, all joints and samples pooled.
    relative: float


@dataclass(frozen=True)
class Errors:
    """Errors on the motion that a model was fitted to, and on motion that it was not."""

    train: TorqueErrors
    validate: TorqueErrors


@dataclass(frozen=True)
class Effect:
    """An effect that the declared model lacked."""

    kind: str
    joints: List[str]
    #: By joint: by name ``value``, ``std``, ``unit``.
    parameters: Dict[str, Dict[str, Dict[str, Any]]]
    #: The error on validation data once it and all before it are in, relative to the torque.
    validate_relative: float
    #: Share of the residual's variance above the noise floor that it took away.
    explains: float
    #: How sure it is against its rivals.
    confidence: float
    #: Effects that the data could not tell from it.
    rivals: List[Dict[str, Any]] = field(default_factory=list)


class Result:
    """An identified model and its report: what :func:`phiw.identify` and :func:`phiw.explain` give.

    Attributes
    ----------
    files : dict
        The files of a result folder, name to content.
    summary : str
        The result as text, as the command prints it.
    warnings : list of str
        What to know before trusting a number.
    """

    def __init__(self, files: Dict[str, bytes], summary: str, warnings: List[str]) -> None:
        self.files = files
        self.summary = summary
        self.warnings = warnings

    @property
    def numbers(self) -> Dict[str, Any]:
        """``report.json``."""
        return json.loads(self.files["report.json"])

    @property
    def model(self) -> Dict[str, Any]:
        """``model.json``: enough to be used by itself."""
        return json.loads(self.files["model.json"])

    @property
    def urdf(self) -> str:
        """The robot's URDF with bodies that can exist and fit the logs."""
        return self.files["identified.urdf"].decode()

    @property
    def mjcf(self) -> str:
        """The same for MuJoCo, with the drives' properties."""
        return self.files["identified.xml"].decode()

    @property
    def html(self) -> str:
        """The report as a page by itself."""
        return self.files["report.html"].decode()

    @property
    def robot(self) -> str:
        """The robot's name."""
        return self.numbers["robot"]

    @property
    def joints(self) -> List[str]:
        """The joints that move, in the order of all arrays."""
        return self.numbers["joints"]

    @property
    def declared(self) -> List[str]:
        """``rigid_body`` and what was declared."""
        return self.numbers["declared"]

    @property
    def verdict(self) -> Optional[str]:
        """``sufficient``, ``explained``, ``partly_explained`` or ``unexplained``; None of ``identify`` where
        the residual may hold more than noise."""
        return self.numbers["verdict"]

    @property
    def before(self) -> Errors:
        """Errors of the declared model."""
        return _errors(self.numbers["before"])

    @property
    def after(self) -> Errors:
        """Errors once all effects are in."""
        return _errors(self.numbers["after"])

    @property
    def noise_floor(self) -> Dict[str, float]:
        """RMS of what no model can explain in each joint's torque (N·m, N)."""
        return _numbers(self.numbers["noise_floor"])

    @property
    def effects(self) -> List[Effect]:
        """What was found, in the order in which it was added."""
        return [_effect(effect) for effect in self.numbers["effects"]]

    @property
    def refinements(self) -> List[Effect]:
        """Effects that are certain, but only polish the form of those found."""
        return [_effect(effect) for effect in self.numbers.get("refinements", [])]

    @property
    def remaining(self) -> Dict[str, Any]:
        """What is left: ``structured``, ``joints``, ``depends_on``."""
        return self.numbers["remaining"]

    @property
    def parameters(self) -> Any:
        """All parameters: a DataFrame if pandas is installed, else a list of dicts.

        Columns: ``kind`` (``rigid_body`` or an effect's), ``joints``, ``name``, ``value``, ``std``, ``low``
        and ``high`` (95 % interval), ``unit``, ``declared``.
        """
        model = self.model
        rows = [_row("rigid_body", "", parameter, {}, True) for parameter in model["base_parameters"]]
        for effect in model["effects"]:
            joints = "+".join(effect["joints"])
            # What was fitted by linearisation stands partly in the constant of the same name.
            around = effect.get("constants") or {}
            rows.extend(
                _row(effect["kind"], joints, parameter, around, effect["declared"])
                for parameter in effect["parameters"]
            )
        return frame(rows)

    def predict(self, logs: "Logs", **options: Any) -> "Prediction":
        """Torques of this model along logs, see :func:`phiw.predict`."""
        from .sessions import predict

        return predict(self, logs, **options)

    def report(self, out: PathLike) -> pathlib.Path:
        """Writes the result folder: ``model.json``, ``report.json``, ``report.html``, ``identified.urdf``,
        ``identified.xml``; all of them, or none. Gives the path of the page."""
        _phiw.write_results(os.fspath(out), list(self.files.items()))
        return pathlib.Path(out) / "report.html"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Result) and self.__dict__ == other.__dict__

    def __str__(self) -> str:
        return self.summary

    def __repr__(self) -> str:
        relative = self.after.validate.relative
        effects = ", ".join(effect.kind for effect in self.effects)
        found = f"; {effects}" if effects else ""
        return f"<Result: {self.robot}, {self.verdict or 'identified'}, {_percent(relative)} of RMS torque{found}>"

    def _repr_html_(self) -> str:
        before, after = self.before, self.after
        rows = [
            ["", *self.joints, "pooled"],
            ["before", *_cells(before.validate), _percent(before.validate.relative)],
            ["after", *_cells(after.validate), _percent(after.validate.relative)],
            ["noise floor", *(f"{value:.3g}" for value in self.noise_floor.values()), ""],
        ]
        text = f"<p><b>{html.escape(self.robot)}</b>: {(self.verdict or 'identified').replace('_', ' ')}</p>"
        text += "<p>RMS error of the torque on motion held out (N·m, N):</p>" + _table(rows)
        if self.effects:
            found = [["effect", "joints", "explains", "confidence"]]
            found += [
                [effect.kind, ", ".join(effect.joints), _percent(effect.explains), _percent(effect.confidence)]
                for effect in self.effects
            ]
            text += _table(found)
        warnings = "".join(f"<li>{html.escape(warning)}</li>" for warning in self.warnings)
        return text + (f"<ul>{warnings}</ul>" if warnings else "")


class Prediction:
    """Torques along logs; arrays of one row for each row of the logs that can be used, a column for each joint.

    Attributes
    ----------
    joints : list of str
    t : array, shape (N,)
        Time in the log (s).
    log : array of int, shape (N,)
        Which log the row is of.
    tau, tau_std : array, shape (N, dof)
        Predicted torque and its standard deviation (N·m, N), parameters' and noise's together.
    low, high : array, shape (N, dof)
        95 % band.
    residual : array, shape (N, dof)
        Measured minus predicted; NaN where nothing was measured.
    effects : dict
        Each kind's share of the torque, shape (N, dof).
    relative : float
        RMS of the residual over RMS of the torque, pooled; NaN without torques.
    warnings : list of str
    """

    def __init__(
        self,
        joints: List[str],
        columns: Dict[str, np.ndarray],
        log: np.ndarray,
        relative: float,
        warnings: List[str],
    ) -> None:
        self.joints = joints
        self.columns = columns
        self.log = log
        self.relative = relative
        self.warnings = warnings
        self.t = columns["t"]
        self.tau = self._of("tau")
        self.tau_std = self._of("tau_std")
        self.low = self.tau - BAND_95 * self.tau_std
        self.high = self.tau + BAND_95 * self.tau_std
        self.residual = self._of("residual")
        kinds = {name.split(".", 1)[0] for name in columns if "." in name} - {"tau", "tau_std", "residual"}
        self.effects = {kind: self._of(kind, 0.0) for kind in sorted(kinds)}

    def _of(self, prefix: str, absent: float = np.nan) -> np.ndarray:
        nothing = np.full(len(self.t), absent)
        each = [self.columns.get(f"{prefix}.{joint}", nothing) for joint in self.joints]
        return np.stack(each, axis=1) if each else np.empty((len(self.t), 0))

    @property
    def frame(self) -> Any:
        """All columns as ``phiw predict`` writes them: a DataFrame if pandas is installed, else a dict."""
        return frame(self.columns)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        told = "" if np.isnan(self.relative) else f", {_percent(self.relative)} of RMS torque"
        return f"<Prediction: {len(self)} rows, {len(self.joints)} joints{told}>"


def load(path: PathLike) -> Result:
    """The result in a folder that ``phiw identify``, ``phiw explain`` or :meth:`Result.report` wrote."""
    folder = pathlib.Path(path)
    try:
        files = {name: (folder / name).read_bytes() for name in FILES}
    except OSError as error:
        raise InputError(f"{folder} is no folder of results: {error}") from None
    numbers = json.loads(files["report.json"])
    warnings = numbers.get("warnings") or (numbers.get("phiw") or {}).get("warnings") or []
    return Result(files, f"{numbers['robot']}, from {folder}", warnings)


def model_text(model: Union[Result, Mapping[str, Any], PathLike]) -> str:
    """The text of a ``model.json``."""
    if isinstance(model, Result):
        return model.files["model.json"].decode()
    if isinstance(model, Mapping):
        return json.dumps(model)
    path = pathlib.Path(model)
    if path.is_dir():
        path = path / "model.json"
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read as a model.json: {error}") from None


def _number(value: Optional[float]) -> float:
    """A number that is not finite is null in JSON."""
    return float("nan") if value is None else value


def _numbers(values: Mapping[str, Optional[float]]) -> Dict[str, float]:
    return {name: _number(value) for name, value in values.items()}


def _errors(errors: Mapping[str, Any]) -> Errors:
    def of(part: Mapping[str, Any]) -> TorqueErrors:
        return TorqueErrors(_numbers(part["rmse"]), _number(part["relative"]))

    return Errors(of(errors["train"]), of(errors["validate"]))


def _effect(effect: Mapping[str, Any]) -> Effect:
    return Effect(
        effect["kind"],
        effect["joints"],
        effect["parameters"],
        _number(effect["validate_relative"]),
        _number(effect["explains"]),
        _number(effect["confidence"]),
        effect["rivals"],
    )


def _row(
    kind: str, joints: str, parameter: Mapping[str, Any], around: Mapping[str, float], declared: bool
) -> Dict[str, Any]:
    shift = around.get(parameter["name"], 0.0)
    low, high = parameter.get("interval_95") or (None, None)
    return {
        "kind": kind,
        "joints": joints,
        "name": parameter["name"],
        "value": parameter["value"] + shift,
        "std": _number(parameter["std"]),
        "low": _number(low) + shift,
        "high": _number(high) + shift,
        "unit": parameter["unit"],
        "declared": declared,
    }


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def _cells(errors: TorqueErrors) -> List[str]:
    return [f"{value:.3g}" for value in errors.rmse.values()]


def _table(rows: Sequence[Sequence[str]]) -> str:
    def line(row: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in row) + "</tr>"

    return "<table>" + line(rows[0], "th") + "".join(line(row, "td") for row in rows[1:]) + "</table>"

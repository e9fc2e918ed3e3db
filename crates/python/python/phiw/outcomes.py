"""What checks, the choice of a motion and retargeting give."""

from __future__ import annotations

import csv
import html
import io
import json
import os
import pathlib
from dataclasses import dataclass
from typing import Any, Dict, List, Tuple, Union

import numpy as np

PathLike = Union[str, "os.PathLike[str]"]


class Check:
    """What is in logs, before anything is fitted to them.

    Attributes
    ----------
    numbers : dict
        As ``phiw check`` writes it.
    summary : str
        The same as text.
    """

    def __init__(self, numbers: Dict[str, Any], summary: str) -> None:
        self.numbers = numbers
        self.summary = summary

    @property
    def findings(self) -> List[Dict[str, str]]:
        """Each with ``log``, ``kind``, ``column``, ``measured``, ``consequence`` and ``mend``."""
        return self.numbers["findings"]

    @property
    def logs(self) -> List[Dict[str, Any]]:
        """Rows, length, rate and clock of each log."""
        return self.numbers["logs"]

    @property
    def refused(self) -> List[str]:
        """Why no identification would begin."""
        return self.numbers["refused"]

    def __bool__(self) -> bool:
        """Whether nothing was found."""
        return not (self.findings or self.refused)

    def __str__(self) -> str:
        return self.summary

    def __repr__(self) -> str:
        return f"<Check: {len(self.logs)} logs, {len(self.findings)} findings>"

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.summary)}</pre>"


class NextMotion:
    """The motion that a robot should run next.

    Attributes
    ----------
    motion : dict
        Columns of the motion, with the torque that is predicted for it: ``t``, ``q``, ``qd``, ``qdd`` and
        ``tau``, those of joints of shape (N, dof).
    numbers : dict
        Why it was chosen.
    summary : str
    warnings : list of str
        What to look at before the robot moves.
    """

    def __init__(
        self, joints: List[str], files: Dict[str, bytes], summary: str, warnings: List[str]
    ) -> None:
        self.files = files
        self.summary = summary
        self.warnings = warnings
        self.numbers: Dict[str, Any] = json.loads(files["motion.json"])
        lines = csv.reader(io.StringIO(files["motion.csv"].decode()))
        names = next(lines)
        table = np.array([[float(cell) if cell else np.nan for cell in line] for line in lines])
        columns = dict(zip(names, table.T))
        self.motion: Dict[str, np.ndarray] = {"t": columns["t"]}
        for signal in ("q", "qd", "qdd", "tau"):
            each = [columns.get(f"{signal}.{joint}") for joint in joints]
            if all(column is not None for column in each):
                self.motion[signal] = np.stack(each, axis=1)  # type: ignore[arg-type]

    def write(self, path: PathLike) -> pathlib.Path:
        """Writes the motion as a log, and beside it the reason, with the extension .json."""
        path = pathlib.Path(path)
        path.write_bytes(self.files["motion.csv"])
        path.with_suffix(".json").write_bytes(self.files["motion.json"])
        return path

    def __str__(self) -> str:
        return self.summary

    def __repr__(self) -> str:
        seconds = self.motion["t"][-1] - self.motion["t"][0]
        return f"<NextMotion: {self.numbers.get('motion', '')} {seconds:.1f} s>"


@dataclass(frozen=True)
class Retargeted:
    """What became of marker recordings."""

    #: The folder with a log and a report for each.
    out: pathlib.Path
    summary: str
    warnings: List[str]
    #: Recordings that could not be retargeted, each with the reason.
    failures: List[Tuple[str, str]]
    #: What the motions are written as: ``"csv"`` or ``"npz"``.
    format: str = "csv"

    @property
    def motions(self) -> List[pathlib.Path]:
        """The motions in the folder."""
        return sorted(self.out.glob(f"*.{self.format}"))

    def __str__(self) -> str:
        return self.summary

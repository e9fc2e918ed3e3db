"""Logs however people have them: a path, a dict of arrays, a data frame of pandas or polars."""

from __future__ import annotations

import os
from typing import Any, Iterable, List, Mapping, Sequence, Tuple, Union

import numpy as np

from ._phiw import InputError

#: A path, a mapping of arrays, or a data frame.
Log = Any
#: What the extension takes: a path, or a name and named columns.
TakenLog = Union[str, Tuple[str, List[Tuple[str, np.ndarray]]]]

#: Signals that may come as one array of a column for each joint.
SIGNALS = ("q", "qd", "qdd", "tau", "temp", "qref")


def taken_logs(
    logs: Union[Log, Iterable[Log]], joints: Sequence[str], name: str, mapped: bool = False
) -> List[TakenLog]:
    """All logs as the extension takes them. One that is in memory is called ``name[i]`` in messages.

    Columns of an array are called ``array[i]``, unless it is a signal of all joints. With ``mapped`` a map says
    what they are."""
    if _is_one(logs):
        logs = [logs]
    return [_taken(log, joints, f"{name}[{index}]", mapped) for index, log in enumerate(logs)]


def _is_one(logs: Any) -> bool:
    return isinstance(logs, (str, bytes, os.PathLike, Mapping)) or hasattr(logs, "columns")


def _taken(log: Log, joints: Sequence[str], name: str, mapped: bool) -> TakenLog:
    if isinstance(log, (str, bytes, os.PathLike)):
        return os.fsdecode(log)
    if isinstance(log, Mapping):
        items = [(str(key), _array(values)) for key, values in log.items()]
    elif hasattr(log, "columns") and hasattr(log, "__getitem__"):
        # Time is often the index of a data frame.
        index = getattr(log, "index", None)
        if "t" not in list(log.columns) and getattr(index, "name", None) == "t":
            log = log.reset_index()
        items = [(str(column), _array(log[column])) for column in log.columns]
    else:
        raise InputError(
            f"{name} is a {type(log).__name__}; give a log as a path, a dict of arrays, or a data frame"
        )
    columns: List[Tuple[str, np.ndarray]] = []
    for key, values in items:
        if values.dtype.kind not in "fiub":
            continue  # names, units and the like
        if values.ndim == 1 and key in SIGNALS and len(joints) == 1:
            values = values[:, None]
        if values.ndim == 2 and key in SIGNALS and values.shape[1] == len(joints):
            columns.extend((f"{key}.{joint}", values[:, i]) for i, joint in enumerate(joints))
        elif values.ndim == 2 and (mapped or key not in SIGNALS):
            columns.extend((f"{key}[{i}]", values[:, i]) for i in range(values.shape[1]))
        elif values.ndim == 1:
            columns.append((key, values))
        elif values.ndim == 2:
            raise InputError(
                f"{name}, `{key}`: it has {values.shape[1]} columns, but the robot has {len(joints)} joints"
                f" ({', '.join(joints)}); give one column for each, in this order"
            )
        else:
            raise InputError(
                f"{name}, `{key}`: it has the shape {values.shape}; give columns of one number a row,"
                f" or {', '.join(SIGNALS)} with one column for each joint"
            )
    return name, columns


def _array(values: Any) -> np.ndarray:
    """An array; what is missing in a data frame is NaN."""
    to_numpy = getattr(values, "to_numpy", None)
    if to_numpy is None:
        return np.asarray(values)
    array = np.asarray(to_numpy())
    if array.dtype.kind == "O":  # pandas' own kinds of missing values
        try:
            return np.asarray(to_numpy(dtype=float, na_value=np.nan))
        except (TypeError, ValueError):
            pass
    return array

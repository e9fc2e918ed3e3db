"""ezc3d's reading of C3D files: for each, the points of all frames as doubles (NaN where missing) and the labels.

Arguments: the folder for the answers, then the files. Answer i is `i.points` and `i.json`.
"""

import json
import pathlib
import sys

import ezc3d
import numpy


def values(parameters, name):
    return parameters[name]["value"] if name in parameters else []


folder = pathlib.Path(sys.argv[1])
for index, path in enumerate(sys.argv[2:]):
    file = ezc3d.c3d(path)
    parameters = file["parameters"]["POINT"]
    # 4 × points × frames to frames × points × 3
    points = numpy.ascontiguousarray(numpy.moveaxis(file["data"]["points"][:3], [0, 1, 2], [2, 1, 0]), dtype="<f8")
    points.tofile(folder / f"{index}.points")
    labels = [label for name in ("LABELS", "LABELS2", "LABELS3") for label in values(parameters, name)]
    answer = {
        "labels": labels[: points.shape[1]],
        "rate_hz": float(values(parameters, "RATE")[0]),
        "frames": points.shape[0],
    }
    (folder / f"{index}.json").write_text(json.dumps(answer))

"""Read complete, unusual and broken files with camera_calibration_parsers of either side."""

from __future__ import annotations

import json
import os
import random
import sys
import tempfile

from camera_calibration_parsers import readCalibration

chance = random.Random(int(sys.argv[1]))  # noqa: S311
found = {}


def numbers(count):
    forms = [
        lambda: chance.uniform(-9, 9), lambda: chance.choice([0, 1]), lambda: chance.uniform(-1, 1) * 1e-7,
    ]  # fmt: skip
    return [chance.choice(forms)() for _ in range(count)]


def yaml_of(**more):
    values = {"image_width": chance.randint(0, 5000), "image_height": chance.randint(0, 5000)}
    values |= {"camera_name": "left", "distortion_model": "plumb_bob"} | more
    shapes = {"camera_matrix": (3, 3), "rectification_matrix": (3, 3), "projection_matrix": (3, 4)}
    shapes["distortion_coefficients"] = (1, chance.choice([0, 4, 5, 8]))
    for name, (rows, columns) in shapes.items():
        data = values.pop(f"{name}_data", numbers(rows * columns))
        values[name] = f"\n  rows: {rows}\n  cols: {columns}\n  data: {data}"
    return "".join(f"{name}: {value}\n" for name, value in values.items() if value is not None)


def ini_of(name="narrow_stereo/left", coefficients=5):
    def rows(count, columns):
        return "".join(" ".join(map(str, numbers(columns))) + "\n" for _ in range(count))

    return (
        f"# a camera\n[image]\n\nwidth\n640\n\nheight\n480\n\n[{name}]\n\ncamera matrix\n{rows(3, 3)}\n"
        f"distortion\n{rows(1, coefficients)}\nrectification\n{rows(3, 3)}\nprojection\n{rows(3, 4)}"
    )


def asked(name, text):
    path = os.path.join(folder, name)
    if text is not None:
        with open(path, "w") as file:
            file.write(text)
    answer = readCalibration(path)
    if answer:
        info = answer[1]
        size = info.width, info.height, info.distortion_model
        answer = [answer[0], *size, *map(list, (info.D, info.K, info.R, info.P)), info.binning_x]
    found[f"{len(found)} {name}"] = answer


with tempfile.TemporaryDirectory() as folder:
    for _ in range(20):
        asked("a.yaml", yaml_of())
        asked("a.ini", ini_of(coefficients=chance.choice([0, 4, 5, 8])))
    asked("a.yml", yaml_of(camera_name='"a: b #c"'))
    for name in ("image_width", "image_height", "camera_name", "distortion_model"):
        asked("missing.yaml", yaml_of(**{name: None}))
    for value in ("-5", "640.0", "abc", "4294967295", "4294967296", "[1]", '"640"', "true"):
        asked("width.yaml", yaml_of(image_width=value))
    for value in (
        "[1, 2]", "[1, 2, 3, 4, 5, 6, 7, 8, 9, 10]", "[1e-3, .5, 5., +1, 5, 6, 7, 8, 9]", "abc", "[]",
    ):  # fmt: skip
        asked("matrix.yaml", yaml_of(camera_matrix_data=value))
    for value in (
        "[.inf, -.inf, 0, 0, 5, 6, 7, 8, 9]", "[a, 2, 3, 4, 5, 6, 7, 8, 9]", "[[1], 2, 3, 4, 5, 6, 7, 8, 9]",
    ):  # fmt: skip
        asked("matrix.yaml", yaml_of(camera_matrix_data=value))
    for text in (
        "", "a: [1", "- 1\n", "abc", yaml_of() + "binning_x: 2\n", yaml_of().replace("cols: 3", "cols: x"),
    ):  # fmt: skip
        asked("broken.yaml", text)
    whole = ini_of()
    for text in (
        *(
            "", whole[:150], whole.replace("640", "-3"), whole.replace("640", "6 ; c"),
            whole.replace("image", "x"),
        ),
        *(
            whole.replace("\n", " "), whole.replace("\n", "\r\n"), whole + "\n[more]\n",
            whole.replace("#", ";"),
        ),
        *(ini_of("a b"), ini_of(""), whole.replace("camera matrix", "Camera matrix")),
        whole.replace("[narrow", "[externals]\ntranslation\n1 2 3\nrotation\n4 5 6\n[narrow"),
        whole.replace("[narrow", "[externals]\ntranslation\n1 2 3\n[narrow"),
    ):  # fmt: skip
        # One line starts with its comment.
        asked("odd.ini", text.replace("# a camera ", ""))
    asked("a.txt", yaml_of())
    asked("missing.yaml", None)
    asked("missing.ini", None)
print(json.dumps(found))

"""Run ROS 2's generators for one package. The Python of a build environment runs this file, not pipros.

Arguments: the package's name, the `share` folder that contains its definitions, the environment's `share`
folder, and the folder for the results.
"""

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

FAST, INTROSPECTION = "rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"
GENERATORS: dict[str, tuple[str, dict[str, list[str]]]] = {
    "rosidl_generator_c": ("GenerateC", {}),
    FAST: ("GenerateFastRTPSCTypesupport", {}),
    INTROSPECTION: ("GenerateIntrospectionCTypesupport", {}),
    "rosidl_typesupport_c": (
        "GenerateCTypesupport",
        {"typesupport_implementations": [FAST, INTROSPECTION]},
    ),
    "rosidl_generator_py": ("GeneratePython", {"typesupport_implementations": ["rosidl_typesupport_c"]}),
}


def main(package: str, source: str, share: str, output: str) -> None:
    """Write the source of each library to a folder with its name, and `.idl` files to `idl`."""
    folder = Path(source, package)
    definitions = []
    for file in sorted(folder.glob("*/*")):
        adapter: Any = import_module("rosidl_adapter")
        made = adapter.convert_to_idl(folder, package, file.relative_to(folder), Path(output, "idl"))
        definitions.append(f"{made.parent.parent}:{made.relative_to(made.parent.parent)}")
    for library, (name, options) in GENERATORS.items():
        generator = getattr(import_module(f"{library}.cli"), name)("", **options)
        generator.generate(package, definitions, [source, share], Path(output, library, package))


if __name__ == "__main__":
    main(*sys.argv[1:])

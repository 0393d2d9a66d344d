"""Call the functions of genpy that message tools use; see `examine_api_nodes.py`."""

import os
import pathlib
import tempfile
import warnings

from examination import begin, examine

warnings.simplefilter("ignore")

TYPES = ["int32", "int32[]", "int32[3]", "uint8[]", "uint8[4]", "char[]", "bool", "bool[2]", "string"]
TYPES += ["string[]", "time", "duration", "time[]", "byte", "float64", "float32[2]", "std_msgs/String"]
TYPES += [
    "std_msgs/String[]",
    "std_msgs/Header",
    "p/Inner",
    "p/Inner[2]",
    "Inner",
    "Inner[]",
    "roslib/Header",
]


def examine_generator():
    import genmsg
    from genpy import base, generator, message

    begin("genpy types")
    examine("simple types", lambda: list(base.SIMPLE_TYPES))
    for kind in TYPES:
        for name in ("is_simple", "is_special"):
            examine(f"{name} {kind}", lambda: getattr(generator, name)(kind))
        examine(f"compute_post_deserialize {kind}", lambda: generator.compute_post_deserialize(kind, "x"))
    for kind in ("time", "duration"):
        special = generator.get_special(kind)
        examine(kind, lambda: (special.constructor, special.import_str, special.get_post_deserialize("x")))
    for text in ("a", b"a", 5):
        examine("isstring", lambda: message.isstring(text))
    context = genmsg.MsgContext.create_default()
    load = genmsg.msg_loader.load_msg_from_string
    inner = load(context, "int32 a\nstring[] names\ntime stamp\n", "p/Inner")
    outer = load(
        context, "Header header\nInner one\nInner[] many\nint32 X=1\nstring None\nfloat32[3] v\n", "p/Outer"
    )
    load(context, "uint32 seq\ntime stamp\nstring frame_id\n", "std_msgs/Header")
    load(context, "string data\n", "std_msgs/String")
    begin("genpy generator")
    for kind in TYPES:
        for name in ("compute_constructor", "compute_import"):
            examine(f"{name} {kind}", lambda: getattr(generator, name)(context, "p", kind))
        examine(f"default_value {kind}", lambda: generator.default_value(context, kind, "p"))
        examine(f"compute_pkg_type {kind}", lambda: generator.compute_pkg_type("p", kind))
    for kind in ("a/b/c", ""):
        examine(f"compute_pkg_type {kind}", lambda: generator.compute_pkg_type("p", kind))
    for kind in ("p/Inner", "p/None"):
        examine("registered", lambda: generator.get_registered_ex(context, kind).full_name)
    for name in ("Name.msg", "/a/b/Name.msg", "Name"):
        examine("resource", lambda: generator.compute_resource_name(name, ".msg"))
        examine("outfile", lambda: generator.compute_outfile_name("/out", name, ".msg"))
    safe = generator.make_python_safe(outer)
    examine("safe", lambda: (safe.names, safe.types, [constant.name for constant in safe.constants]))
    for spec in (inner, outer):
        flat = generator.flatten(context, spec)
        examine("flatten", lambda: (flat.names, flat.types))
    for kinds in (["int32"], ["int32", "float64", "uint8"], ["bool", "time"], [], None, ["string"]):
        examine(f"pattern {kinds}", lambda: generator.compute_struct_pattern(kinds))
    for pattern in ("iiii", "ii", "i", "", "ibbbd", "I3I"):
        examine(f"reduce {pattern}", lambda: generator.reduce_pattern(pattern))
    genmsg.load_depends(context, inner, {})
    examine("text", lambda: generator.compute_full_text_escaped(context, inner))
    examine("indent", lambda: generator.INDENT)


def examine_modules():
    from genpy import generate_initpy

    begin("genpy modules")
    with tempfile.TemporaryDirectory() as folder:
        for name in ("msg/_A.py", "msg/_B.py", "srv/_C.py", "srv/other.txt"):
            os.makedirs(os.path.dirname(os.path.join(folder, name)), exist_ok=True)
            open(os.path.join(folder, name), "w").close()
        for part in ("msg", "srv"):
            examine(part, lambda: generate_initpy.write_modules(os.path.join(folder, part)))
        for name in ("__init__.py", "msg/__init__.py", "srv/__init__.py"):
            path = pathlib.Path(folder, name)
            examine(name, lambda: sorted(path.read_text().split("\n")) if path.exists() else None)


examine_generator()
examine_modules()

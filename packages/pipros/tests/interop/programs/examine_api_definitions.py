"""Call functions of genmsg with valid and invalid arguments; see `examine_api_nodes.py`."""

import os
import tempfile
import warnings

from examination import begin, examine

warnings.simplefilter("ignore")

PLAIN = (str, int, float, bytes, list, dict, tuple, type(None))
TYPES = [
    "int32", "int32[]", "int32[3]", "std_msgs/String", "Header", "String", "a b", "x[[", "x[-1]", "x[a]",
    None,
]  # fmt: skip
TYPES += [
    "std_msgs/String[]", "roslib/Header", "std_msgs/Header", "time", "", "x[]]", "a/b/c", "1a", "byte",
    "bool",
]  # fmt: skip
NAMES = ["a", "/a", "", "pkg/Name", "a/b/c", "1a", "a b", "~a", "a/", " a ", "a//b"]


def call(label, function, *args, **kwds):
    shown = [arg for arg in args if isinstance(arg, PLAIN)]
    examine(f"{label}{shown}{kwds or ''}", lambda: function(*args, **kwds))


def call_each(module, names, arguments):
    for name in names.split():
        for argument in arguments:
            call(f"{module.__name__}.{name}", getattr(module, name), argument)


def shape(spec):
    """Return the contents of a message specification."""
    constants = [(one.type, one.name, one.val, one.val_text) for one in spec.constants]
    return [
        spec.types, spec.names, constants, spec.full_name, spec.package, spec.short_name, spec.has_header(),
    ]  # fmt: skip


def examine_names(module):
    begin(f"{module.__name__} names")
    call_each(module, "is_legal_resource_name is_legal_resource_base_name package_resource_name", NAMES)
    call_each(module, "resource_name_base resource_name_package", NAMES)
    for name in NAMES:
        call("resource_name", module.resource_name, "p", name)
        call("resource_name", module.resource_name, "p", name, "p")
        for pattern in ("BASE_RESOURCE_NAME_LEGAL_CHARS_P", "RESOURCE_NAME_LEGAL_CHARS_P"):
            examine(f"{pattern} {name!r}", lambda: bool(getattr(module, pattern).match(name)))


def examine_genmsg():
    import genmsg
    import genmsg.msg_loader
    import genmsg.msgs
    import genmsg.names

    examine_names(genmsg.names)
    for name in ("a", "a/", " a ", "/a/", "a//"):
        call("normalize_package_context", genmsg.names.normalize_package_context, name)
    begin("genmsg types")
    call_each(genmsg.msgs, "bare_msg_type is_builtin is_header_type is_valid_msg_type parse_type", TYPES)
    call_each(genmsg.msgs, "is_valid_constant_type", TYPES)
    call_each(genmsg.msgs, "is_valid_msg_field_name", [one for one in TYPES if one is not None])
    for kind in TYPES:
        if kind is not None:
            call("resolve_type", genmsg.msgs.resolve_type, kind, "pkg")
            call("Field", lambda kind: sorted(vars(genmsg.msgs.Field("f", kind)).items()), kind)
            call("MsgSpec", lambda kind: shape(genmsg.MsgSpec([kind], ["f"], [], "t", "p/N")), kind)
    values = ["1", "-1", "1.5", "abc", "", "true", "0x10", "300", "1e3", " 5 "]
    for kind in (
        "int8", "uint8", "int64", "uint32", "float32", "string", "bool", "byte", "char", "time", "x/Y",
    ):  # fmt: skip
        for value in values:
            if kind == "bool" and not value.strip().isdecimal():
                continue  # an error with the text of Python's parser
            call("convert_constant_value", genmsg.msg_loader.convert_constant_value, kind, value)
    begin("genmsg objects")
    for args in (("int32", "X", 1, "1"), (None, "X", 1, "1"), ("int32", "X", None, "1")):
        call("Constant", lambda *args: str(genmsg.msgs.Constant(*args)), *args)
    one, same = (genmsg.msgs.Constant("int32", "X", 1, "1") for _ in range(2))
    examine("constants", lambda: (one == same, one != same, one == 5, repr(one)))
    for args in (
        (["int32"], ["a"], [], "t", "p/N"), (["int32"], ["a", "b"], [], "t", "p/N"),
        (["int32", "int32"], ["a", "a"], [], "t", "p/N"), (["int32"], ["a"], [], "t", ""),
        (["int32"], ["a"], [], "t", "p/N", "q", "M"), (["std_msgs/Header"], ["header"], [], "t", "p/N"),
        (["std_msgs/Header[]"], ["header"], [], "t", "p/N"), (["Header"], ["header"], [], "t", "p/N"),
    ):  # fmt: skip
        call("MsgSpec", lambda *args: shape(genmsg.MsgSpec(*args)), *args)
        call("MsgSpec", lambda *args: (str(genmsg.MsgSpec(*args)), repr(genmsg.MsgSpec(*args))), *args)
    half = genmsg.MsgSpec([], [], [], "", "p/NRequest")
    for other in ("N", "M"):
        services = [genmsg.SrvSpec(half, half, "---", "p/N", name, "p") for name in ("N", other)]
        examine(f"services {other}", lambda: (services[0] == services[1], services[0] != services[1]))
    examine("service", lambda: (str(services[0]), repr(services[0])))
    examine_loading(genmsg)
    call("log_verbose", genmsg.log_verbose, False)
    call("log", genmsg.log, "text", 5)
    call("plog", genmsg.plog, "text", {"a": 1})


def examine_loading(genmsg):
    import genmsg.gentools

    begin("genmsg loading")
    context = genmsg.MsgContext.create_default()
    examine(
        "default", lambda: [context.is_registered(name) for name in ("time", "duration", "a/B", "time[]")]
    )
    texts = [
        "int32 X=3\nstring a\nHeader h\nfoo/Bar[] b\nBaz z\n",
        "Header header\nint32[4] values # what\n\nstring S=  text # kept\n", "bogus", "int32 1x",
        "int32 a\nint32 a", "int32 X=a", "int32[] X=1", "time X=1", "", "int8 A=200", "a b c",
    ]  # fmt: skip
    for text in texts:
        call(
            "load_msg_from_string",
            lambda text: shape(genmsg.msg_loader.load_msg_from_string(context, text, "p/N")),
            text,
        )
    for text in ("int32 a\n---\nint32 b\n", "int32 a", "---", "bogus\n---\n", "int32 A=1\n---\n"):
        load = genmsg.msg_loader.load_srv_from_string
        call(
            "load_srv",
            lambda text: [
                shape(half) for half in (lambda s: (s.request, s.response))(load(context, text, "p/S"))
            ],
            text,
        )
    examine_search(genmsg, context)


def examine_search(genmsg, context):
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for name, text in (
            ("p/msg/Outer.msg", "Header header\nInner[] inner\nint32 X=1 # one\n"),
            ("p/msg/Inner.msg", "q/Other other\ntime t\n"), ("q/msg/Other.msg", "string[3] s\n# comment\n"),
            ("p/msg/Lost.msg", "q/Nowhere n\n"), ("p/srv/Ask.srv", "Inner i\n---\nq/Other o\n"),
            ("std_msgs/msg/Header.msg", "uint32 seq\ntime stamp\nstring frame_id\n"),
        ):  # fmt: skip
            os.makedirs(os.path.dirname(name), exist_ok=True)
            with open(name, "w") as file:
                file.write(text)
        path = {"p": ["p/msg"], "q": ["q/msg"], "std_msgs": ["std_msgs/msg"]}
        services = {"p": ["p/srv"]}
        loader = genmsg.msg_loader
        for package, name in (("p", "Outer"), ("p", "None"), ("none", "A")):
            call("get_msg_file", loader.get_msg_file, package, name, path)
            call("get_srv_file", loader.get_srv_file, package, name, services)
        for search in (path, {}, None, ["p/msg"], "p"):
            for name in ("p/Outer", "p/None", "none/A", "Outer"):
                call(
                    "load_msg_by_type",
                    lambda name: shape(loader.load_msg_by_type(context, name, search)),
                    name,
                )
        for name in ("p/Outer", "p/Lost"):
            spec = loader.load_msg_by_type(context, name, path)
            call("load_depends", loader.load_depends, context, spec, path)
            call("get_depends", context.get_depends, name)
            call("get_all_depends", context.get_all_depends, name)
            call("get_file", context.get_file, name)
            for function in ("compute_md5_text", "compute_md5", "compute_full_text", "compute_md5_v2"):
                if name == "p/Outer":
                    call(function, getattr(genmsg.gentools, function), context, spec)
        for thing in (None, "p/Outer", 5):
            call("load_depends", loader.load_depends, context, thing, path)
        service = loader.load_srv_by_type(context, "p/Ask", services)
        call("load_depends", loader.load_depends, context, service, path)
        call("compute_md5", genmsg.gentools.compute_md5, context, service)
        call("compute_full_text", genmsg.gentools.compute_full_text, context, service)
        for file in ("Outer.msg", "Ask.srv", "x.txt", ""):
            call("compute_full_type_name", genmsg.gentools.compute_full_type_name, "p", file)
        os.chdir("/")


examine_genmsg()

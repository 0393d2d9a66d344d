"""Any expression has a value within limits, or raises ExpressionError.

python -m tests.fuzz.expressions --seconds 60
"""

import sys
import warnings
from contextlib import suppress

from pipros.safe import guarded
from pipros.safe.expr import arithmetic, evaluate
from pipros.safe.expr_walk import ExpressionError
from pipros.safe.methods import METHODS
from tests.fuzz import mutation

WORDS = [
    *(
        b"(", b")", b"[", b"]", b"{", b"}", b", ", b": ", b" + ", b" * ", b" ** ", b" % ", b" << ", b" // ",
        b" - ",
    ),
    *(
        b" in ", b" == ", b" < ", b" and ", b" or ", b"not ", b" if ", b" else ", b"[:]", b"f'{", b"}'", b"'",
        b"%s",
    ),
    *(
        b"9**9", b"1000", b"2305843009213693951", b"range(1000)", b"[0] * 1000", b"'a' * 1000", b"1e308",
        b"True",
    ),
    *(
        f"{name}(".encode()
        for name in sorted({*guarded.FUNCTIONS, "dict", "pow", "prod", "range", "set", "sum"})
    ),
    *(f".{name}(".encode() for name in sorted({name for table in METHODS.values() for name in table})),
    *(b"lambda: ", b"for x in ", b"x := ", b"a", b"xs", b"s", b"d", b".__class__", b"*a", b"**a"),
    *(b"[x for x in xs]", b"{x for x in ", b"{k: v for k, v in d.items()}", b"(x, y) ", b"for y in range(x)"),
    *(b"map(len, ", b"filter(None, ", b"key=len", b"'{0[k]:>{1}}'", b"{0.x}", b"'\\t'"),
]  # fmt: skip
NAMES = {"a": 3, "s": "text", "xs": [1, 2.5, "x"], "d": {"k": [1]}}


def target(data: bytes) -> None:
    text = data.decode("utf-8", "replace")
    with suppress(ExpressionError):
        evaluate(text, names=NAMES)
    with suppress(ExpressionError):
        arithmetic(text)


if __name__ == "__main__":
    warnings.simplefilter("ignore")  # a warning of Python's parser about `1if x`
    sys.exit(mutation.main(target, "expressions", WORDS))

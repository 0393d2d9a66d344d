"""`ParameterGenerator` and type names, which `.cfg` files import."""

from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.reconfigure.generator import ParameterGenerator as ParameterGenerator

_star_names(__name__, "inspect os re sys string:Template textwrap")

str_t = "str"
bool_t = "bool"
int_t = "int"
double_t = "double"

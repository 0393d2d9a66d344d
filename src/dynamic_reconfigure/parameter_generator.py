"""Names imported by old `.cfg` files."""

from pipros.reconfigure.generator import ParameterGenerator as ParameterGenerator

str_t = "str"
bool_t = "bool"
int_t = "int"
double_t = "double"

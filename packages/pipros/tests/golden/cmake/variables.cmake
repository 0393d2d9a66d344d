# Cases of variables: a script that sets `o`, then the value that CMake 3.25 gives it, behind `#= `.

set(o a b)
#= a;b

set(o "a b")
#= a b

set(o)
set(o "<${o}>")
#= <>

set(o x)
unset(o)
set(o "<${o}>")
#= <>

set(ENV{MY_V} x)
set(o "$ENV{MY_V}")
#= x

set(ENV{MY_V} x)
unset(ENV{MY_V})
set(o "<$ENV{MY_V}>")
#= <>

set(ENV{MY_V})
set(o "<$ENV{MY_V}>")
#= <>

set(X c CACHE STRING "d")
set(o "${X}")
#= c

set(X c CACHE STRING "d")
set(X e CACHE STRING "d")
set(o "${X}")
#= c

set(X c CACHE STRING "d")
set(X e CACHE STRING "d" FORCE)
set(o "${X}")
#= e

set(X c CACHE STRING "d")
set(X n)
set(o "${X}")
unset(X)
set(o "${o}${X}")
#= nc

set(X c CACHE STRING "d")
unset(X CACHE)
set(o "<${X}>")
#= <>

set(X c CACHE INTERNAL "d")
set(o "$CACHE{X}")
#= c

option(OPT "text")
set(o "${OPT}")
#= OFF

option(OPT "text" ON)
set(o "${OPT}")
#= ON

set(OPT mine)
option(OPT "text" ON)
set(o "${OPT}")
#= mine

function(f)
set(V inner PARENT_SCOPE)
set(V own)
set(W w)
endfunction()
set(V outer)
f()
set(o "${V}<${W}>")
#= inner<>

function(f)
unset(V PARENT_SCOPE)
endfunction()
set(V outer)
f()
set(o "<${V}>")
#= <>

macro(m)
set(V inner)
endmacro()
set(V outer)
m()
set(o "${V}")
#= inner

function(f a b)
set(o "${a}|${b}|${ARGC}|${ARGV}|${ARGN}|${ARGV2}" PARENT_SCOPE)
endfunction()
f(1 2 3 4)
#= 1|2|4|1;2;3;4|3;4|3

macro(m a)
set(o "${a}|${ARGC}|${ARGN}|${ARGV1}")
endmacro()
m(1 2 3)
#= 1|3|2;3|2

function(f)
return()
set(o never PARENT_SCOPE)
endfunction()
set(o before)
f()
#= before

function(F)
set(o called PARENT_SCOPE)
endfunction()
f()
#= called

set_property(GLOBAL PROPERTY P a b)
get_property(o GLOBAL PROPERTY P)
#= a;b

set_property(GLOBAL PROPERTY P a)
set_property(GLOBAL APPEND PROPERTY P b)
get_property(o GLOBAL PROPERTY P)
#= a;b

set_property(GLOBAL PROPERTY P a)
set_property(GLOBAL APPEND_STRING PROPERTY P b)
get_property(o GLOBAL PROPERTY P)
#= ab

get_property(o GLOBAL PROPERTY NOPE)
set(o "<${o}>")
#= <>

set_property(GLOBAL PROPERTY P a)
get_property(o GLOBAL PROPERTY P SET)
#= 1

get_property(o GLOBAL PROPERTY NOPE DEFINED)
#= 0

include(CMakeParseArguments)
cmake_parse_arguments(A "X;Y" "ONE" "MANY" X ONE 1 MANY a b rest)
set(o "${A_X}|${A_Y}|${A_ONE}|${A_MANY}|${A_UNPARSED_ARGUMENTS}")
#= TRUE|FALSE|1|a;b;rest|

cmake_parse_arguments(A "X" "ONE" "MANY" a ONE MANY)
set(o "${A_X}|${A_UNPARSED_ARGUMENTS}|${A_KEYWORDS_MISSING_VALUES}|<${A_ONE}>")
#= FALSE|a|MANY;ONE|<>

cmake_parse_arguments(A "" "ONE" "" ONE 1 2 ONE 3)
set(o "${A_ONE}|${A_UNPARSED_ARGUMENTS}")
#= 3|2

cmake_parse_arguments(A "" "" "MANY" MANY a MANY b)
set(o "${A_MANY}")
#= a;b

function(f)
cmake_parse_arguments(PARSE_ARGV 1 A "X" "ONE" "MANY")
set(o "${A_X}|${A_ONE}|${A_MANY}|${A_UNPARSED_ARGUMENTS}" PARENT_SCOPE)
endfunction()
f(skip X ONE "a;b" MANY c "d;e")
#= TRUE|a;b|c;d\;e|

function(f)
cmake_parse_arguments(A "" "ONE" "MANY" ${ARGN})
set(o "<${A_ONE}>${A_MANY}" PARENT_SCOPE)
endfunction()
f(ONE "" MANY a)
#= <>a

set(N V)
set(${N} x)
set(o "${V}")
#= x

set(a_b x)
set(V b)
set(o "${a_${V}}")
#= x

set(V "a;b")
set(o ${V} c)
#= a;b;c

set(V "a;b")
set(o "${V} c")
#= a;b c

set(o \${x})
#= ${x}

set(o "a\\b\tc\"d")
#= a\b	c"d

set(o [[a ${b}]])
#= a ${b}

set(o [=[a]]b]=])
#= a]]b

set(o a\;b c)
list(LENGTH o n)
set(o "${n}")
#= 3

set(o "@V@")
#= @V@

set(o $ENV{SURELY_UNSET_X}a)
#= a

set(o "a\
b")
#= ab

set(o a#comment
b)
#= a;b

set(o "a;b" "c;d")
list(LENGTH o n)
set(o "${n}")
#= 4

set(V)
set(o "${V}x${V}")
#= x

set(CMAKE_X "1")
set(o "${CMAKE_X}${CMAKE_Y}")
#= 1

set(o a"b"c)
#= a"b"c

set(o -DX="a b")

#= -DX="a b"

cmake_parse_arguments(A "" "ONE" "" ONE ONE 3)
set(o "${A_ONE}|${A_KEYWORDS_MISSING_VALUES}")
#= 3|ONE

cmake_parse_arguments(A "" "ONE" "" ONE 3 ONE)
set(o "${A_ONE}|${A_KEYWORDS_MISSING_VALUES}")
#= 3|ONE

cmake_parse_arguments(A "X" "" "MANY" MANY X MANY a)
set(o "${A_MANY}|${A_X}|${A_KEYWORDS_MISSING_VALUES}")
#= a|TRUE|MANY

function(f)
cmake_parse_arguments(PARSE_ARGV 0 A "" "" "M")
set(o "${A_M}|${A_UNPARSED_ARGUMENTS}" PARENT_SCOPE)
endfunction()
f("x;y" M "p;q" r)
#= p\;q;r|x\;y

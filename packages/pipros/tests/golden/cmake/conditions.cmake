# Cases of conditions: a script that sets `o`, then the value that CMake 3.25 gives it, behind `#= `.

if(1)
set(o yes)
endif()
#= yes

if("1")
set(o yes)
endif()
#= yes

if(V)
set(o yes)
else()
set(o no)
endif()
#= no

set(V x)
if(V)
set(o yes)
else()
set(o no)
endif()
#= yes

set(V OFF)
if(V)
set(o yes)
else()
set(o no)
endif()
#= no

set(V x-NOTFOUND)
if(V)
set(o yes)
else()
set(o no)
endif()
#= no

set(V 0.0)
if(V)
set(o yes)
else()
set(o no)
endif()
#= yes

set(V 00)
if(V)
set(o yes)
else()
set(o no)
endif()
#= yes

set(V x)
if("V")
set(o yes)
else()
set(o no)
endif()
#= no

set(V ON)
if("${V}")
set(o yes)
else()
set(o no)
endif()
#= yes

set(V ON)
if(${V})
set(o yes)
else()
set(o no)
endif()
#= yes

if(1.5)
set(o yes)
else()
set(o no)
endif()
#= yes

if(-1)
set(o yes)
else()
set(o no)
endif()
#= yes

if(0x1)
set(o yes)
else()
set(o no)
endif()
#= yes

if(1e1)
set(o yes)
else()
set(o no)
endif()
#= yes

if(1 EQUAL 1.0)
set(o yes)
else()
set(o no)
endif()
#= yes

if(1 EQUAL "1 ")
set(o yes)
else()
set(o no)
endif()
#= yes

if(1 LESS 2 AND 2 LESS 3)
set(o yes)
else()
set(o no)
endif()
#= yes

if(1 OR 0 AND 0)
set(o yes)
else()
set(o no)
endif()
#= no

if(NOT 0 AND NOT 0)
set(o yes)
else()
set(o no)
endif()
#= yes

if(NOT (1 AND 0))
set(o yes)
else()
set(o no)
endif()
#= yes

if(a STRLESS b)
set(o yes)
else()
set(o no)
endif()
#= yes

if(b STRGREATER a)
set(o yes)
else()
set(o no)
endif()
#= yes

if(a STRLESS_EQUAL a)
set(o yes)
else()
set(o no)
endif()
#= yes

if(1.2 VERSION_LESS 1.10)
set(o yes)
else()
set(o no)
endif()
#= yes

if(1.2.0 VERSION_EQUAL 1.2)
set(o yes)
else()
set(o no)
endif()
#= yes

if(1.2rc1 VERSION_LESS 1.2.1)
set(o yes)
else()
set(o no)
endif()
#= yes

if("" VERSION_LESS 1)
set(o yes)
else()
set(o no)
endif()
#= yes

if(2 VERSION_GREATER_EQUAL 2)
set(o yes)
else()
set(o no)
endif()
#= yes

if("abc" MATCHES "b(c)")
set(o "${CMAKE_MATCH_1}")
endif()
#= c

set(V abc)
if(V MATCHES "^a")
set(o yes)
else()
set(o no)
endif()
#= yes

set(L a b)
if(a IN_LIST L)
set(o yes)
else()
set(o no)
endif()
#= yes

set(V a)
set(L a b)
if(V IN_LIST L)
set(o yes)
else()
set(o no)
endif()
#= yes

if("" IN_LIST NOPE)
set(o yes)
else()
set(o no)
endif()
#= no

if(DEFINED V)
set(o yes)
else()
set(o no)
endif()
#= no

set(V "")
if(DEFINED V)
set(o yes)
else()
set(o no)
endif()
#= yes

set(ENV{X_X} 1)
if(DEFINED ENV{X_X})
set(o yes)
else()
set(o no)
endif()
#= yes

if(DEFINED ENV{SURELY_UNSET_X})
set(o yes)
else()
set(o no)
endif()
#= no

set(X c CACHE STRING d)
if(DEFINED CACHE{X})
set(o yes)
else()
set(o no)
endif()
#= yes

if(DEFINED CACHE{NOPE})
set(o yes)
else()
set(o no)
endif()
#= no

if(COMMAND message)
set(o yes)
else()
set(o no)
endif()
#= yes

if(COMMAND nope_nope)
set(o yes)
else()
set(o no)
endif()
#= no

function(mine)
endfunction()
if(COMMAND Mine)
set(o yes)
else()
set(o no)
endif()
#= yes

if(POLICY CMP0048)
set(o yes)
else()
set(o no)
endif()
#= yes

if(POLICY CMP9999)
set(o yes)
else()
set(o no)
endif()
#= no

if(TARGET nope)
set(o yes)
else()
set(o no)
endif()
#= no

if(TEST nope)
set(o yes)
else()
set(o no)
endif()
#= no

if(EXISTS /)
set(o yes)
else()
set(o no)
endif()
#= yes

if(EXISTS "")
set(o yes)
else()
set(o no)
endif()
#= no

if(IS_DIRECTORY /)
set(o yes)
else()
set(o no)
endif()
#= yes

if(IS_ABSOLUTE /a)
set(o yes)
else()
set(o no)
endif()
#= yes

if(IS_ABSOLUTE a/b)
set(o yes)
else()
set(o no)
endif()
#= no

if(IS_ABSOLUTE "
/a")
set(o yes)
else()
set(o no)
endif()
#= no

if(/nope IS_NEWER_THAN /)
set(o yes)
else()
set(o no)
endif()
#= yes

if("/a//b" PATH_EQUAL "/a/b")
set(o yes)
else()
set(o no)
endif()
#= yes

if("/a/./b" PATH_EQUAL "/a/b")
set(o yes)
else()
set(o no)
endif()
#= no

set(STREQUAL x)
if(a STREQUAL a)
set(o yes)
else()
set(o no)
endif()
#= yes

if(Y)
set(o yes)
else()
set(o no)
endif()
#= yes

if(yes AND True)
set(o yes)
else()
set(o no)
endif()
#= yes

if(N)
set(o yes)
else()
set(o no)
endif()
#= no

if(IGNORE)
set(o yes)
else()
set(o no)
endif()
#= no

if(NOTFOUND)
set(o yes)
else()
set(o no)
endif()
#= no

if("NOT" STREQUAL "NOT")
set(o yes)
else()
set(o no)
endif()
#= yes

if("AND" AND 1)
set(o yes)
else()
set(o no)
endif()
#= no

set(V W)
set(W x)
if(V STREQUAL "W")
set(o yes)
else()
set(o no)
endif()
#= yes

if(a STREQUAL a AND b STREQUAL b OR c)
set(o yes)
else()
set(o no)
endif()
#= yes

if((1) AND (0 OR (1)))
set(o yes)
else()
set(o no)
endif()
#= yes

set(V "1;2")
if("${V}" STREQUAL "1;2")
set(o yes)
else()
set(o no)
endif()
#= yes

if(12345678901234567890 EQUAL 12345678901234567890)
set(o yes)
else()
set(o no)
endif()
#= yes

if(abc LESS 1)
set(o yes)
else()
set(o no)
endif()
#= no

if(1 GREATER_EQUAL 1)
set(o yes)
else()
set(o no)
endif()
#= yes

if(NOT DEFINED V AND NOT V)
set(o yes)
else()
set(o no)
endif()
#= yes

if(EXISTS nope OR IS_SYMLINK nope)
set(o yes)
else()
set(o no)
endif()

#= no

set(L "")
if("" IN_LIST L)
set(o yes)
else()
set(o no)
endif()
#= yes

if("1abc" EQUAL 1)
set(o yes)
else()
set(o no)
endif()
#= yes

if("  2" EQUAL 2)
set(o yes)
else()
set(o no)
endif()
#= yes

if(.5)
set(o yes)
else()
set(o no)
endif()
#= yes

if("1 ")
set(o yes)
else()
set(o no)
endif()
#= no

if(1.2. VERSION_EQUAL 1.2)
set(o yes)
else()
set(o no)
endif()
#= yes

if(v1 VERSION_EQUAL 0)
set(o yes)
else()
set(o no)
endif()
#= yes

if(0 OR 1 AND 0 OR 1)
set(o yes)
else()
set(o no)
endif()
#= yes

if(NOT 1 OR 1)
set(o yes)
else()
set(o no)
endif()
#= yes

if(a/b PATH_EQUAL a//b)
set(o yes)
else()
set(o no)
endif()
#= yes

if()
set(o yes)
else()
set(o no)
endif()
#= no

if(NOT)
set(o yes)
else()
set(o no)
endif()
#= no

if(1 AND NOT $ENV{SURELY_UNSET_X})
set(o yes)
else()
set(o no)
endif()
#= no

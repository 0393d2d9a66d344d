# Cases of files: a script that sets `o`, then the value that CMake 3.25 gives it, behind `#= `.

file(WRITE w/a.txt "x")
file(READ w/a.txt o)
#= x

file(WRITE w/a.txt "x" "y")
file(APPEND w/a.txt "z")
file(READ w/a.txt o)
#= xyz

file(WRITE w/a.txt "hello")
file(READ w/a.txt o LIMIT 2)
#= he

file(WRITE w/a.txt "hello")
file(READ w/a.txt o OFFSET 2)
#= llo

file(WRITE w/a.txt "hi")
file(READ w/a.txt o HEX)
#= 6869

file(WRITE w/a.txt "a\nb;c\n\nd")
file(STRINGS w/a.txt L)
list(LENGTH L o)
#= 4

file(WRITE w/a.txt "a\nb\nab")
file(STRINGS w/a.txt o REGEX "^a")
#= a;ab

file(WRITE w/a.txt "a\nb\nc")
file(STRINGS w/a.txt o LIMIT_COUNT 2)
#= a;b

file(WRITE w/a.txt "abc")
file(SIZE w/a.txt o)
#= 3

file(WRITE w/a.txt "")
file(READ w/a.txt o)
set(o "<${o}>")
#= <>

file(WRITE w/a.txt "abc")
file(MD5 w/a.txt o)
#= 900150983cd24fb0d6963f7d28e17f72

file(WRITE w/a.txt "abc")
file(SHA256 w/a.txt o)
#= ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad

file(TOUCH_NOCREATE w/t)
if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/w/t)
set(o yes)
else()
set(o no)
endif()
#= no

file(WRITE w/a "x")
file(REMOVE w/a w/nope)
if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/w/a)
set(o yes)
else()
set(o no)
endif()
#= no

file(WRITE w/a/b "x")
file(REMOVE_RECURSE w/a)
if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/w/a)
set(o yes)
else()
set(o no)
endif()
#= no

file(WRITE w/a "x")
file(RENAME w/a w/b)
file(READ w/b o)
#= x

file(MAKE_DIRECTORY w/x/y)
if(IS_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/w/x/y)
set(o yes)
endif()
#= yes

file(WRITE w/a "x")
file(COPY w/a DESTINATION w/d)
file(READ w/d/a o)
#= x

file(WRITE w/d/a "x")
file(WRITE w/d/b.txt "y")
file(COPY w/d DESTINATION w/e PATTERN "*.txt" EXCLUDE)
file(GLOB_RECURSE o RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} w/e/*)
#= w/e/d/a

file(WRITE w/d/a "x")
file(WRITE w/d/b.txt "y")
file(COPY w/d/ DESTINATION w/e FILES_MATCHING PATTERN "*.txt")
file(GLOB_RECURSE o RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} w/e/*)
#= w/e/b.txt

file(WRITE w/d/a.py "x")
file(WRITE w/d/s/b.py "y")
file(COPY w/d/ DESTINATION w/e REGEX "/s/" EXCLUDE)
file(GLOB_RECURSE o RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} w/e/*)
#= w/e/a.py

file(WRITE w/a "x")
file(COPY_FILE w/a w/b)
file(READ w/b o)
#= x

file(WRITE w/a "x")
file(CREATE_LINK a w/l SYMBOLIC)
file(READ_SYMLINK w/l o)
#= a

file(WRITE w/a.in "@V@")
set(V 1)
configure_file(w/a.in w/a)
file(READ w/a o)
#= 1
#=

file(WRITE w/a.in "\${V}@V@")
set(V 1)
configure_file(w/a.in w/a @ONLY)
file(READ w/a o)
#= ${V}1
#=

file(WRITE w/a.in "@V@")
configure_file(w/a.in w/a COPYONLY)
file(READ w/a o)
#= @V@

file(WRITE w/a.in "#cmakedefine A\n#cmakedefine B\n#cmakedefine01 A\n#cmakedefine01 B\n#cmakedefine A \"@V@\"\n# cmakedefine A\n")
set(A 1)
set(V v)
configure_file(w/a.in w/a)
file(READ w/a o)
#= #define A
#= /* #undef B */
#= #define A 1
#= #define B 0
#= #define A "v"
#= # define A
#=

file(WRITE w/a.in "#cmakedefine A @A@ x\n#cmakedefine01 B extra\n")
set(A 7)
configure_file(w/a.in w/a)
file(READ w/a o)
#= #define A 7 x
#= #define B extra 0
#=

file(WRITE w/a.in "\"@V@\"")
set(V "a\"b")
configure_file(w/a.in w/a ESCAPE_QUOTES)
file(READ w/a o)
#= "a\"b"
#=

file(WRITE w/a.in "@a b@ @ @x@y")
set(x 1)
configure_file(w/a.in w/a)
file(READ w/a o)
#= @a b@ @ 1y
#=

file(CONFIGURE OUTPUT w/c CONTENT "@V@|" @ONLY)
file(READ w/c o)
#= |

file(WRITE w/b.txt "")
file(WRITE w/a.txt "")
file(WRITE w/c.md "")
file(GLOB o RELATIVE ${CMAKE_CURRENT_SOURCE_DIR}/w w/*.txt)
#= a.txt;b.txt

file(WRITE w/s/a.txt "")
file(WRITE w/b.txt "")
file(GLOB_RECURSE o RELATIVE ${CMAKE_CURRENT_SOURCE_DIR}/w w/*.txt)
#= b.txt;s/a.txt

file(WRITE w/s/a.txt "")
file(GLOB o RELATIVE ${CMAKE_CURRENT_SOURCE_DIR}/w w/*)
#= s

file(WRITE w/s/a.txt "")
file(WRITE w/f "")
file(GLOB o LIST_DIRECTORIES false RELATIVE ${CMAKE_CURRENT_SOURCE_DIR}/w w/*)
#= f

file(GLOB o nope/*)
set(o "<${o}>")
#= <>

file(WRITE w/a1 "")
file(WRITE w/a2 "")
file(WRITE w/a3 "")
file(GLOB o RELATIVE ${CMAKE_CURRENT_SOURCE_DIR}/w w/a[12] w/a?)
#= a1;a2;a3

file(TIMESTAMP nope o)
set(o "<${o}>")
#= <>

file(WRITE w/a.cmake "set(o included)")
include(w/a.cmake)
#= included

file(WRITE w/a.cmake "set(o \${CMAKE_CURRENT_LIST_FILE})")
include(w/a.cmake)
get_filename_component(o ${o} NAME)
#= a.cmake

file(WRITE w/a.cmake "set(o x)
return()
set(o never)")
include(w/a.cmake)
#= x

include(nope.cmake OPTIONAL)
set(o ok)
#= ok

include(nope.cmake OPTIONAL RESULT_VARIABLE o)
#= NOTFOUND

file(WRITE w/a.cmake "")
include(w/a.cmake RESULT_VARIABLE o)
get_filename_component(o ${o} NAME)
#= a.cmake

file(WRITE w/M.cmake "set(o module)")
list(APPEND CMAKE_MODULE_PATH ${CMAKE_CURRENT_SOURCE_DIR}/w)
include(M)
#= module

file(WRITE w/g.cmake "include_guard()
string(APPEND o x)")
include(w/g.cmake)
include(w/g.cmake)
#= x

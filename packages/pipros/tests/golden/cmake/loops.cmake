# Cases of loops: a script that sets `o`, then the value that CMake 3.25 gives it, behind `#= `.

foreach(i a b c)
string(APPEND o "${i},")
endforeach()
#= a,b,c,

foreach(i RANGE 3)
string(APPEND o "${i},")
endforeach()
#= 0,1,2,3,

foreach(i RANGE 1 3)
string(APPEND o "${i},")
endforeach()
#= 1,2,3,

foreach(i RANGE 1 7 3)
string(APPEND o "${i},")
endforeach()
#= 1,4,7,

foreach(i RANGE 3 1)
string(APPEND o "${i},")
endforeach()
#= 3,2,1,

foreach(i RANGE 3 1 -1)
string(APPEND o "${i},")
endforeach()
#= 3,2,1,

foreach(i RANGE 0)
string(APPEND o "${i},")
endforeach()
#= 0,

set(L a b)
foreach(i IN LISTS L)
string(APPEND o "${i},")
endforeach()
#= a,b,

set(L a b)
foreach(i IN LISTS L ITEMS c L)
string(APPEND o "${i},")
endforeach()
#= a,b,c,L,

set(L a b)
foreach(i IN ITEMS ${L} c)
string(APPEND o "${i},")
endforeach()
#= a,b,c,

set(L a "" b)
foreach(i IN LISTS L)
string(APPEND o "<${i}>")
endforeach()
#= <a><><b>

set(L a b)
set(M 1 2 3)
foreach(x y IN ZIP_LISTS L M)
string(APPEND o "${x}${y},")
endforeach()
#= a1,b2,3,

set(L a b)
set(M 1 2)
foreach(x IN ZIP_LISTS L M)
string(APPEND o "${x_0}${x_1},")
endforeach()
#= a1,b2,

foreach(i a b c)
if(i STREQUAL b)
continue()
endif()
string(APPEND o "${i}")
endforeach()
#= ac

foreach(i a b c)
if(i STREQUAL b)
break()
endif()
string(APPEND o "${i}")
endforeach()
#= a

set(i x)
foreach(i a b)
endforeach()
set(o "${i}")
#= x

foreach(i a b)
endforeach()
set(o "<${i}>")
#= <>

set(n 0)
while(n LESS 3)
math(EXPR n "${n}+1")
string(APPEND o "${n}")
endwhile()
#= 123

set(n 0)
while(TRUE)
math(EXPR n "${n}+1")
if(n EQUAL 2)
continue()
endif()
if(n GREATER 4)
break()
endif()
string(APPEND o "${n}")
endwhile()
#= 134

foreach(i)
set(o never)
endforeach()
set(o "<${o}>")
#= <>

foreach(i IN ITEMS)
set(o never)
endforeach()
set(o "<${o}>")
#= <>

foreach(i a b)
foreach(j 1 2)
if(j EQUAL 2)
break()
endif()
string(APPEND o "${i}${j},")
endforeach()
endforeach()
#= a1,b1,

function(f)
foreach(i a b)
if(i STREQUAL b)
return()
endif()
set(o ${i} PARENT_SCOPE)
endforeach()
endfunction()
f()
#= a

set(L a b)
foreach(i ${L})
list(APPEND L c)
string(APPEND o "${i}")
endforeach()
#= ab

set(o x)
if(FALSE)
set(o a)
elseif(TRUE)
set(o b)
else()
set(o c)
endif()
#= b

if(TRUE)
if(FALSE)
set(o a)
else()
set(o b)
endif()
else()
set(o c)
endif()
#= b

block()
set(V in)
set(o "x" PARENT_SCOPE)
endblock()
set(o "${o}<${V}>")
#= x<>

block(PROPAGATE V)
set(V in)
endblock()
set(o "<${V}>")
#= <in>

block(SCOPE_FOR VARIABLES)
set(V in)
endblock()
set(o "<${V}>")
#= <>

block(SCOPE_FOR POLICIES)
set(V in)
endblock()
set(o "<${V}>")
#= <in>

IF(TRUE)
SET(o upper)
ENDIF(TRUE)

#= upper

foreach(i RANGE 1 2 0)
string(APPEND o "${i},")
endforeach()
#= 1,2,

foreach(i RANGE)
string(APPEND o "<${i}>")
endforeach()
#= <0>

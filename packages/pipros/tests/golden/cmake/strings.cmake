# Cases of strings: a script that sets `o`, then the value that CMake 3.25 gives it, behind `#= `.

string(FIND "abcabc" "c" o)
#= 2

string(FIND "abcabc" "c" o REVERSE)
#= 5

string(FIND "abc" "z" o)
#= -1

string(REPLACE "a" "b" o "banana")
#= bbnbnb

string(REPLACE "a" "" o "ba" "na")
#= bn

string(REGEX MATCH "[0-9]+" o "ab12cd34")
#= 12

string(REGEX MATCH "x" o "ab")
#=

string(REGEX MATCHALL "[0-9]+" o "ab12cd34")
#= 12;34

string(REGEX REPLACE "([a-z])([0-9])" "\\2\\1" o "a1b2")
#= 1a2b

string(REGEX REPLACE "^v" "" o "v1.2v")
#= 1.2v

string(REGEX REPLACE "." "x" o "ab" "c")
#= xxx

string(REGEX MATCH "([a-z]+)=(.*)" m "key=value")
set(o "${CMAKE_MATCH_COUNT}${CMAKE_MATCH_0}|${CMAKE_MATCH_1}|${CMAKE_MATCH_2}")
#= 2key=value|key|value

string(REGEX MATCH "(a)|(b)" m "b")
set(o "${CMAKE_MATCH_COUNT}<${CMAKE_MATCH_1}><${CMAKE_MATCH_2}>")
#= 2<><b>

set(o a)
string(APPEND o b c)
#= abc

set(o a)
string(PREPEND o b c)
#= bca

string(CONCAT o a b "c d")
#= abc d

string(JOIN "-" o a b c)
#= a-b-c

string(JOIN "-" o)
set(o "<${o}>")
#= <>

string(TOLOWER "AbC" o)
#= abc

string(TOUPPER "AbC" o)
#= ABC

string(LENGTH "abc" o)
#= 3

string(LENGTH "ä" o)
#= 2

string(STRIP "  a b 	" o)
set(o "<${o}>")
#= <a b>

string(SUBSTRING "abcdef" 1 3 o)
#= bcd

string(SUBSTRING "abcdef" 2 -1 o)
#= cdef

string(SUBSTRING "abc" 3 1 o)
set(o "<${o}>")
#= <>

string(SUBSTRING "abc" 1 99 o)
#= bc

string(REPEAT "ab" 3 o)
#= ababab

string(REPEAT "ab" 0 o)
set(o "<${o}>")
#= <>

string(COMPARE LESS a b o)
#= 1

string(COMPARE EQUAL a b o)
#= 0

string(COMPARE NOTEQUAL a b o)
#= 1

string(COMPARE GREATER_EQUAL b b o)
#= 1

string(COMPARE GREATER a b o)
#= 0

string(COMPARE LESS_EQUAL a b o)
#= 1

string(ASCII 65 66 67 o)
#= ABC

string(HEX "aZ" o)
#= 615a

string(MAKE_C_IDENTIFIER "1a-b c" o)
#= _1a_b_c

string(MAKE_C_IDENTIFIER "ok_1" o)
#= ok_1

string(MD5 o "abc")
#= 900150983cd24fb0d6963f7d28e17f72

string(SHA1 o "abc")
#= a9993e364706816aba3e25717850c26c9cd0d89d

string(SHA256 o "abc")
#= ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad

set(V v)
string(CONFIGURE "@V@ \${V} @NO@" o)
#= v v 

set(V v)
string(CONFIGURE "@V@ \${V}" o @ONLY)
#= v ${V}

set(V v)
string(CONFIGURE "@V@" o ESCAPE_QUOTES)
#= v

set(V "a\"b")
string(CONFIGURE "@V@" o ESCAPE_QUOTES)
#= a\"b

string(RANDOM LENGTH 4 ALPHABET a o)
#= aaaa

set(o "a b  c")
separate_arguments(o)
#= a;b;;c

separate_arguments(o UNIX_COMMAND "a 'b c' \"d e\" f\\ g")
#= a;b c;d e;f g

separate_arguments(o NATIVE_COMMAND "a 'b c'")
#= a;b c

separate_arguments(o WINDOWS_COMMAND "C:\\a\\b.exe 'x y' \"c d\"")
#= C:\a\b.exe;'x;y';c d

separate_arguments(o UNIX_COMMAND "a;b c")
list(LENGTH o n)
set(o "${n}")
#= 2

string(TIMESTAMP t "%Y" UTC)
string(LENGTH "${t}" o)
#= 4

string(REPLACE ";" "," o "a;b;c")
#= a,b,c

set(L a b)
string(REPLACE ";" "," o "${L}")
#= a,b

set(L a b)
string(REPLACE "a" "c" o ${L})
#= cb

string(REGEX MATCHALL "a" o "aaa")
#= a;a;a

string(REGEX MATCH "a\\.b" o "axb a.b")
#= a.b

string(REGEX MATCH "a[.]b" o "a.b")
#= a.b

string(REGEX MATCH "[^/]+$" o "a/b/c")
#= c

string(REGEX MATCH "a+" o "caat")
#= aa

string(REGEX MATCH "[]]" o "a]")
#= ]

string(REGEX MATCH "{x}" o "a{x}b")
#= {x}

string(REGEX MATCH "a|b|c" o "xxc")
#= c

string(REGEX MATCH "(a|b)+" o "xabab")
#= abab

string(REGEX REPLACE "[ \t]+" " " o "a  	b")
#= a b

string(REGEX REPLACE "\n" "|" o "a
b")
#= a|b

string(REGEX MATCH "^b" o "a
b")
set(o "<${o}>")
#= <>

string(REGEX MATCH "a.b" o "a
b")
#= a
#= b

string(REGEX REPLACE "x" "\\\\" o "axb")
#= a\b

string(REGEX MATCH "\\d" o "1d")
#= d

string(REGEX MATCH "[\\]" o "a\\b")
#= \

string(UUID o NAMESPACE 6ba7b810-9dad-11d1-80b4-00c04fd430c8 NAME www.example.com TYPE SHA1)
#= 2ed6657d-e927-568b-95e1-2665a8aea6a2

string(FIND "a" "" o)
#= 0

string(TOUPPER "" o)
set(o "<${o}>")
#= <>

string(LENGTH "" o)
#= 0

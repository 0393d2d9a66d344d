# Cases of lists: a script that sets `o`, then the value that CMake 3.25 gives it, behind `#= `.

set(L a b c)
list(LENGTH L o)
#= 3

set(L "")
list(LENGTH L o)
#= 0

list(LENGTH UNSET o)
#= 0

set(L a b c)
list(GET L 0 -1 o)
#= a;c

set(L a b c)
list(GET L 1 o)
#= b

set(L a b c)
list(JOIN L "-" o)
#= a-b-c

set(L a "" c)
list(JOIN L "-" o)
#= a--c

set(L a b c d)
list(SUBLIST L 1 2 o)
#= b;c

set(L a b c d)
list(SUBLIST L 1 -1 o)
#= b;c;d

set(L a b c d)
list(SUBLIST L 2 0 o)
#=

set(L a b c d)
list(SUBLIST L 2 9 o)
#= c;d

set(L a b c)
list(FIND L b o)
#= 1

set(L a b c)
list(FIND L z o)
#= -1

set(o a)
list(APPEND o b "c;d")
#= a;b;c;d

list(APPEND o x)
#= x

set(o a)
list(PREPEND o b c)
#= b;c;a

set(o a d)
list(INSERT o 1 b c)
#= a;b;c;d

set(o a d)
list(INSERT o -1 b)
#= a;b;d

set(o a d)
list(INSERT o 0 x)
#= x;a;d

set(o a d)
list(INSERT o 2 x)
#= a;d;x

set(L a b c)
list(POP_BACK L x)
set(o "${L}|${x}")
#= a;b|c

set(L a b c)
list(POP_FRONT L x y)
set(o "${L}|${x}${y}")
#= c|ab

set(L a b c)
list(POP_BACK L)
set(o "${L}")
#= a;b

set(L "")
list(POP_BACK L x)
set(o "<${L}|${x}>")
#= <|>

set(o a b a c)
list(REMOVE_ITEM o a c)
#= b

set(o a b c d)
list(REMOVE_AT o 0 -1)
#= b;c

set(o a b a c b)
list(REMOVE_DUPLICATES o)
#= a;b;c

set(o a b c)
list(REVERSE o)
#= c;b;a

set(o abc b1 ca)
list(FILTER o INCLUDE REGEX "^[ab]")
#= abc;b1

set(o abc b1 ca)
list(FILTER o EXCLUDE REGEX "a$")
#= abc;b1

set(o c a B b A)
list(SORT o)
#= A;B;a;b;c

set(o c a B b A)
list(SORT o CASE INSENSITIVE)
#= a;A;B;b;c

set(o c a b)
list(SORT o ORDER DESCENDING)
#= c;b;a

set(o a10 a9 a1)
list(SORT o COMPARE NATURAL)
#= a1;a9;a10

set(o x/b y/a z/c)
list(SORT o COMPARE FILE_BASENAME)
#= y/a;x/b;z/c

set(o 1.10 1.9)
list(SORT o COMPARE NATURAL ORDER DESCENDING)
#= 1.10;1.9

set(o a b)
list(TRANSFORM o APPEND x)
#= ax;bx

set(o a b)
list(TRANSFORM o PREPEND x)
#= xa;xb

set(o a b)
list(TRANSFORM o TOUPPER)
#= A;B

set(o A B)
list(TRANSFORM o TOLOWER AT 0)
#= a;B

set(o " a " "b ")
list(TRANSFORM o STRIP)
#= a;b

set(o abc bcd)
list(TRANSFORM o REPLACE "b(.)" "<\\1>")
#= a<c>;<c>d

set(o a b c d)
list(TRANSFORM o TOUPPER AT 1 -1)
#= a;B;c;D

set(o a b c d)
list(TRANSFORM o TOUPPER FOR 0 2 2)
#= A;b;C;d

set(o a b c d)
list(TRANSFORM o TOUPPER FOR 1 2)
#= a;B;C;d

set(o a1 b2 c1)
list(TRANSFORM o APPEND x REGEX "1$")
#= a1x;b2;c1x

set(L a b)
list(TRANSFORM L APPEND x OUTPUT_VARIABLE o)
#= ax;bx

set(L "a;;b")
list(LENGTH L o)
#= 3

set(L "a;;b")
list(GET L 1 o)
set(o "<${o}>")
#= <>

set(L "[a;b]" c)
list(LENGTH L o)
#= 2

set(L "a\;b" c)
list(LENGTH L o)
#= 2

set(L a b)
list(APPEND L "")
list(LENGTH L o)
#= 3

set(o "")
list(APPEND o "" "")
list(LENGTH o n)
set(o "<${o}>${n}")
#= <;>2

set(o "")
list(SORT o)
set(o "<${o}>")
#= <>

set(L "")
list(JOIN L "," o)
set(o "<${o}>")
#= <>

set(L "")
list(SUBLIST L 0 1 o)
set(o "<${o}>")
#= <>

set(o "")
list(INSERT o 0 a)
#= a

set(o "")
list(REMOVE_ITEM o a)
set(o "<${o}>")
#= <>

set(o "")
list(FILTER o INCLUDE REGEX a)
set(o "<${o}>")
#= <>

set(o "")
list(REVERSE o)
set(o "<${o}>")
#= <>

list(FIND NOPE a o)
#= -1
